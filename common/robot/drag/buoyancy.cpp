#include "common/robot/drag/buoyancy.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace phantom::robot {
namespace {

void hold_down(const SerialArm& arm, std::size_t link, const Eigen::Vector3d& p_W_m, double displaced_kg,
               const LinkPoses& X_WL, core::JointArray& tau) noexcept {
  if (displaced_kg > 0.0) arm.add_force(link, p_W_m, {0.0, 0.0, -displaced_kg * kGravity_m_s2}, X_WL, tau);
}

}  // namespace

Buoyancy::Buoyancy(DisplacedParts parts, const Medium& medium) : parts_(std::move(parts)) {
  for (const MediumRegion& region : medium) {
    if (!region.density_kg_per_m3) continue;
    medium_.push_back(region);
    for (const double z_m : {region.min_m.z(), region.max_m.z()})
      if (std::isfinite(z_m)) borders_m_.push_back(z_m);
  }
  std::sort(borders_m_.begin(), borders_m_.end());
  for (std::size_t link = 0; link < parts_.size(); ++link) whole_[link] = whole_of(parts_[link]);
}

Buoyancy::Whole Buoyancy::whole_of(const std::vector<DisplacedPart>& parts) {
  Whole whole;
  Eigen::Vector3d first = Eigen::Vector3d::Zero();
  for (const DisplacedPart& part : parts) {
    whole.volume_m3 += part.volume_m3;
    first += part.volume_m3 * part.centre_m;
    whole.middle_m += part.centre_m / static_cast<double>(parts.size());
  }
  if (!(whole.volume_m3 > 0.0)) return whole;
  whole.centroid_m = first / whole.volume_m3;
  for (const DisplacedPart& part : parts)
    whole.radius_m = std::max(whole.radius_m, (part.centre_m - whole.middle_m).norm() + 0.5 * part.height_m);
  return whole;
}

double Buoyancy::density_at(const Eigen::Vector3d& p_W_m) const noexcept {
  const auto found = std::find_if(medium_.rbegin(), medium_.rend(),
                                  [&](const MediumRegion& region) { return region.contains(p_W_m); });
  return found == medium_.rend() ? 0.0 : *found->density_kg_per_m3;
}

// Mean density over the part's height, above its centre's place.
double Buoyancy::displaced_kg(const DisplacedPart& part, const Eigen::Vector3d& centre_W_m) const noexcept {
  const double height_m = part.height_m, bottom_m = centre_W_m.z() - 0.5 * height_m,
               top_m = bottom_m + height_m;
  if (!(height_m > 0.0)) return part.volume_m3 * density_at(centre_W_m);
  Eigen::Vector3d p_m = centre_W_m;
  double from_m = bottom_m, sum = 0.0;
  const auto add_up_to = [&](double to_m) {
    p_m.z() = 0.5 * (from_m + to_m);
    sum += (to_m - from_m) * density_at(p_m);
    from_m = to_m;
  };
  for (auto border = std::upper_bound(borders_m_.begin(), borders_m_.end(), bottom_m);
       border != borders_m_.end() && *border < top_m; ++border)
    add_up_to(*border);
  add_up_to(top_m);
  return part.volume_m3 * sum / height_m;
}

void Buoyancy::lift_in_parts(const SerialArm& arm, std::size_t link, const LinkPoses& X_WL,
                             core::JointArray& tau) const noexcept {
  for (const DisplacedPart& part : parts_[link]) {
    const Eigen::Vector3d p_W_m = X_WL[link] * part.centre_m;
    hold_down(arm, link, p_W_m, displaced_kg(part, p_W_m), X_WL, tau);
  }
}

void Buoyancy::add_lift(const SerialArm& arm, const LinkPoses& X_WL, core::JointArray& tau) const noexcept {
  if (!acts()) return;
  for (std::size_t link = 1; link <= arm.joint_count(); ++link) {
    const Whole& whole = whole_[link];
    if (!(whole.volume_m3 > 0.0)) continue;
    const Eigen::Vector3d middle_m = X_WL[link] * whole.middle_m;
    const auto region = std::find_if(medium_.rbegin(), medium_.rend(), [&](const MediumRegion& one) {
      return cover_of(one, middle_m, whole.radius_m) != Cover::kNone;
    });
    if (region == medium_.rend()) continue;
    if (cover_of(*region, middle_m, whole.radius_m) == Cover::kAll)
      hold_down(arm, link, X_WL[link] * whole.centroid_m, whole.volume_m3 * *region->density_kg_per_m3, X_WL,
                tau);
    else
      lift_in_parts(arm, link, X_WL, tau);
  }
}

void Buoyancy::add_lift(const SerialArm& arm, const Payload& payload, const LinkPoses& X_WL,
                        core::JointArray& tau) const noexcept {
  if (!acts()) return;
  for (std::size_t link = 1; link <= arm.joint_count(); ++link) {
    const LoadBody& load = payload.on_link[link];
    if (!(load.displaced_m3 > 0.0)) continue;
    const Eigen::Vector3d p_W_m =
        X_WL[link] * Eigen::Vector3d(Eigen::Vector3d::Map(load.displaced_at_m.data()));
    const DisplacedPart cube{p_W_m, load.displaced_m3, std::cbrt(load.displaced_m3)};
    hold_down(arm, link, p_W_m, displaced_kg(cube, p_W_m), X_WL, tau);
  }
}

}  // namespace phantom::robot

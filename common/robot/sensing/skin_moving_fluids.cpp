// What the skin feels in fluids that move with bodies (SkinSensing).
#include <Eigen/Geometry>
#include <algorithm>

#include "common/robot/sensing/skin_sensing_parts.hpp"

namespace phantom::robot {
namespace {

/// How far a cluster sensor's zone reaches beyond its place, at most; and a voxel of reserve.
constexpr double kZoneReach_vox = 1.8 * (ClusterSpec::kMaxReach_vox + 1);

}  // namespace

/// Leaves each sensor of the part in the fluid of greatest μ alone.
void SkinSensing::prevail(Part& part) noexcept {
  std::array<SkinSensing*, kMaxFluids + 1> fluids;
  std::size_t count = 0;
  const std::size_t sensors = sensors_of(part), end = part.first + sensors;
  const auto add_if_met = [&](SkinSensing& fluid) {
    if (kernel::figures_of(&fluid.codes_[part.first], sensors).active > 0) fluids[count++] = &fluid;
  };
  add_if_met(*this);
  for (std::size_t k = 0; k < fluids_.size(); ++k)
    if (reached_by_[part.link][k]) add_if_met(*in_fluids_[k]);
  // Each is held against those before it, which have been through this: a sensor is in one of them at most.
  for (std::size_t k = 1; k < count; ++k) {
    for (std::size_t j = 0; j < k; ++j) {
      for (std::size_t at = part.first; at < end; ++at) {
        if (fluids[k]->codes_[at] == 0 || fluids[j]->codes_[at] == 0) continue;
        SkinSensing& loser = fluids[k]->mu_[at] > fluids[j]->mu_[at] ? *fluids[j] : *fluids[k];
        loser.codes_[at] = 0;
        loser.mu_[at] = 0.0;
      }
    }
  }
}

/// Returns whether a fluid's box may hold a sensor of the link.
bool SkinSensing::reaches(const MovingFluid& fluid, std::size_t link,
                          const geometry::Pose& X_WL) const noexcept {
  const workspace::GridSpec& grid = fluid.voxels->grid();
  const Eigen::Vector3d at_B = fluid.X_WB.inverse() * (X_WL * middle_m_[link]);
  const Eigen::Vector3d nearest = at_B.cwiseMax(grid.origin_m).cwiseMin(grid.origin_m + grid.extent_m());
  // Anything but a distance that is surely greater: also what is not finite is looked at (and feels nothing).
  return !((at_B - nearest).norm() > radius_m_[link] + kZoneReach_vox * grid.voxel_size_m.greatest_m());
}

/// Notes which fluids reach a link, and places it in those.
void SkinSensing::place_in_fluids(std::size_t link, const geometry::Pose& X_WL) noexcept {
  reached_by_[link].reset();
  for (std::size_t k = 0; k < fluids_.size(); ++k) {
    const workspace::GridSpec& grid = fluids_[k].voxels->grid();
    if (grid.voxel_count() <= 0 || !reaches(fluids_[k], link, X_WL)) continue;
    const geometry::Pose X_BL = fluids_[k].X_WB.inverse() * X_WL;
    if (!is_near(X_BL, grid)) continue;
    reached_by_[link][k] = true;
    in_fluids_[k]->place_link(link, X_BL, grid);
    in_fluids_[k]->X_BL_[link] = X_BL;
  }
}

/// Adds what the link feels in moving fluids, whose parts begin beside `first`.
void SkinSensing::take_fluids(std::size_t link, Part& first) noexcept {
  const auto begin = static_cast<std::size_t>(&first - parts_.data());
  std::size_t active = first.totals.active;
  for (std::size_t k = 0; k < fluids_.size(); ++k) {
    if (!reached_by_[link][k]) continue;
    SkinSensing& fluid = *in_fluids_[k];
    Totals& totals = fluid.parts_[begin].totals;
    for (std::size_t i = begin + 1; i < parts_.size() && parts_[i].link == link; ++i)
      totals.add(fluid.parts_[i].totals);
    fluid.take(link, totals, fluid.X_BL_[link], fluids_[k].voxels->grid().voxel_size_m.reference_m());
    fluid_sums_[k][link] = fluid.sums_[link].turned(fluids_[k].X_WB.rotation);
    sums_[link].add(fluid_sums_[k][link]);
    active += totals.active;
    active_ += totals.active;
    muted_ += totals.muted;
    fluid.find_worst(link, fluid.X_BL_, *fluids_[k].voxels);
  }
  if (layout_->normalisation != Normalisation::kActive || active == 0) return;
  sums_[link].scale(1.0 / static_cast<double>(active));
  for (std::size_t k = 0; k < fluids_.size(); ++k)
    fluid_sums_[k][link].scale(1.0 / static_cast<double>(active));
}

/// Takes the worst sensor of the moving fluids, if it is worse than that of the workspace.
void SkinSensing::weigh_fluids(const LinkPoses& X_WL) noexcept {
  for (std::size_t k = 0; k < fluids_.size(); ++k) {
    const SkinSensing& fluid = *in_fluids_[k];
    const WorstSensor& other = fluid.worst_;
    if (!other.found || other.mu < worst_.mu ||
        (other.mu == worst_.mu && fluid.worst_around_mu_ <= worst_around_mu_))
      continue;
    worst_ = other;
    worst_.fluid = k + 1;
    worst_.position_W_m = X_WL[other.link] * layout_->position(other.sensor);
    worst_around_mu_ = fluid.worst_around_mu_;
  }
}

}  // namespace phantom::robot

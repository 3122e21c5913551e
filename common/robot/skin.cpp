#include "common/robot/skin.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace phantom::robot {
namespace {

using core::Status;

struct Counts {
  int sides, rings;
};

double chord_m(double radius_m, int sides) { return 2.0 * radius_m * std::sin(std::numbers::pi / sides); }

double slant_m(const SkinSegment& segment) {
  return std::hypot((segment.to_m - segment.from_m).norm(), segment.to_radius_m - segment.from_radius_m);
}

/// Fewest sides whose chord is below the pitch.
int fewest_sides(double radius_m, double pitch_m) {
  if (chord_m(radius_m, 3) < pitch_m) return 3;
  int sides =
      std::max(3, static_cast<int>(std::numbers::pi / std::asin(std::min(1.0, pitch_m / (2.0 * radius_m)))));
  while (chord_m(radius_m, sides) >= pitch_m) ++sides;
  return sides;
}

std::string check_shape(const SkinSegment& segment) {
  const bool finite =
      segment.from_m.allFinite() && segment.to_m.allFinite() && std::isfinite(segment.spin_rad);
  if (!finite) return "positions and spin must be finite numbers";
  if (!((segment.to_m - segment.from_m).norm() > 1e-6))
    return "both ends are the same point; a length above 0 is needed";
  if (!(segment.from_radius_m >= 0.0) || !(segment.to_radius_m >= 0.0) ||
      !(std::max(segment.from_radius_m, segment.to_radius_m) > 0.0) ||
      !(std::max(segment.from_radius_m, segment.to_radius_m) < 100.0)) {
    return "radii must be 0 or more, one of them above 0, and below 100 m";
  }
  if (!(segment.gain >= 0.0) || !std::isfinite(segment.gain)) return "gain must be 0 or more";
  return {};
}

/// Sensors around and along, given or chosen; an error text if the given ones are too coarse.
core::Expected<Counts> choose_counts(const SkinSegment& segment, double pitch_m) {
  const double radius = std::max(segment.from_radius_m, segment.to_radius_m);
  const int least_sides = fewest_sides(radius, pitch_m);
  const double spans = std::floor(slant_m(segment) / pitch_m) + 1.0;  // fewest spans strictly below the pitch
  if (spans > 1e6 || least_sides > 1'000'000)
    return Status::invalid_argument("needs more than a million sensors");
  const int least_rings = static_cast<int>(spans) + 1;
  const std::string limit = " mm, which is needed for a pitch below " + std::to_string(pitch_m * 1e3) + " mm";
  if (segment.sides && *segment.sides < least_sides) {
    return Status::invalid_argument("sides: " + std::to_string(*segment.sides) + "; allowed: at least " +
                                    std::to_string(least_sides) + " on a radius of " +
                                    std::to_string(radius * 1e3) + limit);
  }
  if (segment.rings && *segment.rings < least_rings) {
    return Status::invalid_argument("rings: " + std::to_string(*segment.rings) + "; allowed: at least " +
                                    std::to_string(least_rings) + " on a length of " +
                                    std::to_string(slant_m(segment) * 1e3) + limit);
  }
  return Counts{segment.sides.value_or(least_sides), segment.rings.value_or(least_rings)};
}

/// Two unit vectors that span the plane across `axis`, fixed by the axis alone so that a layout can be
/// repeated.
std::pair<Eigen::Vector3d, Eigen::Vector3d> across(const Eigen::Vector3d& axis) {
  Eigen::Index least = 0;
  axis.cwiseAbs().minCoeff(&least);
  const Eigen::Vector3d u = (Eigen::Vector3d::Unit(least) - axis[least] * axis).normalized();
  return {u, axis.cross(u)};
}

void add_segment(const SkinSegment& segment, Counts counts, const geometry::Pose& X_link_frame,
                 SkinLayout& layout) {
  const Eigen::Vector3d axis = (segment.to_m - segment.from_m).normalized();
  const auto [u, v] = across(axis);
  const double slant = slant_m(segment);
  const auto radius_at = [&](double t) {
    return segment.from_radius_m + t * (segment.to_radius_m - segment.from_radius_m);
  };
  for (int k = 0; k < counts.rings; ++k) {
    const double spans = counts.rings - 1;
    const double t = k / spans;
    const double t_before = std::max(0.0, (k - 0.5) / spans), t_after = std::min(1.0, (k + 0.5) / spans);
    const double band_m2 =
        std::numbers::pi * (radius_at(t_before) + radius_at(t_after)) * slant * (t_after - t_before);
    for (int p = 0; p < counts.sides; ++p) {
      const double angle = segment.spin_rad + 2.0 * std::numbers::pi * p / counts.sides;
      const Eigen::Vector3d outward = std::cos(angle) * u + std::sin(angle) * v;
      const Eigen::Vector3d from = segment.from_m + segment.from_radius_m * outward;
      const Eigen::Vector3d to = segment.to_m + segment.to_radius_m * outward;
      const Eigen::Vector3d position = X_link_frame * (from + t * (to - from));
      layout.x_m.push_back(position.x());
      layout.y_m.push_back(position.y());
      layout.z_m.push_back(position.z());
      layout.area_m2.push_back(band_m2 / counts.sides);
      layout.weight.push_back(segment.gain);  // completed once the link's number of sensors is known
    }
  }
}

void complete_weights(std::size_t first, SkinLayout& layout) {
  const double share = 1.0 / static_cast<double>(std::max<std::size_t>(1, layout.size() - first));
  for (std::size_t i = first; i < layout.size(); ++i) {
    if (layout.normalisation == Normalisation::kArea) layout.weight[i] *= layout.area_m2[i];
    if (layout.normalisation == Normalisation::kCount) layout.weight[i] *= share;
  }
}

}  // namespace

std::size_t SkinLayout::link_of(std::size_t sensor) const noexcept {
  std::size_t link = 0;
  while (link < core::kMaxJoints && sensor >= first[link + 1]) ++link;
  return link;
}

core::Expected<SkinLayout> lay_out_skin(const SerialArm& arm, const std::vector<LinkSkin>& skin,
                                        const SkinOptions& options) {
  const double pitch_m = options.pitch_vox * options.voxel_size_m;
  if (!(pitch_m > 0.0)) return Status::invalid_argument("skin: voxel size and pitch must be above 0");
  for (const LinkSkin& link : skin) {
    if (!arm.find_frame(link.link)) {
      std::string known;
      for (const Link& candidate : arm.links()) {
        for (const auto& [name, unused] : candidate.frames) known += (known.empty() ? "" : ", ") + name;
      }
      return Status::invalid_argument("skin: link '" + link.link + "' is not in the arm; allowed: " + known);
    }
  }
  SkinLayout layout;
  layout.normalisation = options.normalisation;
  for (std::size_t moving = 0; moving < arm.links().size(); ++moving) {
    layout.first[moving] = layout.size();
    for (const LinkSkin& link : skin) {
      const auto [carrier, X_link_frame] = *arm.find_frame(link.link);
      if (carrier != moving) continue;
      for (std::size_t s = 0; s < link.segments.size(); ++s) {
        const std::string place = "skin: link '" + link.link + "': segments[" + std::to_string(s) + "]: ";
        if (const std::string fault = check_shape(link.segments[s]); !fault.empty()) {
          return Status::invalid_argument(place + fault);
        }
        const auto counts = choose_counts(link.segments[s], pitch_m);
        if (!counts) return Status::invalid_argument(place + counts.status().message());
        if (moving == 0) {
          ++layout.left_out;
          continue;
        }
        const double more = static_cast<double>(counts->sides) * counts->rings;
        if (static_cast<double>(layout.size()) + more > static_cast<double>(options.max_sensors)) {
          return Status::invalid_argument(place + "the skin has more than the allowed " +
                                          std::to_string(options.max_sensors) +
                                          " sensors from here on; widen the pitch or raise the limit");
        }
        add_segment(link.segments[s], *counts, X_link_frame, layout);
      }
    }
    complete_weights(layout.first[moving], layout);
  }
  for (std::size_t rest = arm.links().size(); rest < layout.first.size(); ++rest)
    layout.first[rest] = layout.size();
  if (layout.size() == 0)
    return Status::invalid_argument("skin: no sensors; at least one segment on a moving link is needed");
  return layout;
}

}  // namespace phantom::robot

// Sensors along a line: axis sensors, slender link sensors, finger sensors.
#include <cmath>
#include <numbers>

#include "common/robot/skin/skin_parts.hpp"

namespace phantom::robot::detail {
namespace {

using core::Status;

std::string check_axis(const AxisSensors& axis, const PartRules& rules) {
  if (!axis.from_m.allFinite() || !axis.to_m.allFinite()) return "positions must be finite numbers";
  if (!((axis.to_m - axis.from_m).norm() > 1e-6))
    return "both ends are the same point; a length above 0 is needed";
  if (axis.count && (*axis.count < 1 || *axis.count > 1'000'000))
    return "count: " + std::to_string(*axis.count) + "; allowed: 1 to 1000000";
  if (axis.tip_reach_vox && !axis.cluster) return "tip_reach_vox: stands without a cluster";
  if (axis.tip_reach_vox && (*axis.tip_reach_vox < 1 || *axis.tip_reach_vox > axis.cluster->reach_vox)) {
    return "tip_reach_vox: " + std::to_string(*axis.tip_reach_vox) + "; allowed: 1 to " +
           std::to_string(axis.cluster->reach_vox) + ", the reach at the other end";
  }
  if (axis.radius_m && (!(*axis.radius_m > 0.0) || !(*axis.radius_m < 100.0)))
    return "radius must be above 0 and below 100 m";
  if (!axis.radius_m && !axis.cluster && rules.normalisation == Normalisation::kArea)
    return "point sensors on an axis stand for no area; give a radius, or normalise by count, active or none";
  return check_sensor(axis.gain, axis.cluster);
}

/// Returns the cluster at share `t` of the line; m falls linearly to its value at the tip.
std::optional<ClusterSpec> cluster_at(const AxisSensors& axis, double t) {
  std::optional<ClusterSpec> cluster = axis.cluster;
  if (cluster && axis.tip_reach_vox) {
    const double fall = cluster->reach_vox - *axis.tip_reach_vox;
    cluster->reach_vox = static_cast<int>(std::lround(cluster->reach_vox - t * fall));
  }
  return cluster;
}

/// Returns the ends of the K shares of the line, 0…1; the last is 1.
std::vector<double> places(const AxisSensors& axis, double length_m, const PartRules& rules) {
  std::vector<double> t;
  if (axis.count || !axis.tip_reach_vox) {
    const double count = axis.count ? *axis.count : std::floor(length_m / rules.pitch_of(axis.cluster)) + 1.0;
    for (double k = 1.0; k <= count; k += 1.0) t.push_back(k / count);
    return t;
  }
  for (double along = 0.0; along < 1.0;) {  // steps of m voxels, which shorten as the spheres shrink
    along += rules.pitch_of(cluster_at(axis, along)) / length_m;
    t.push_back(std::min(along, 1.0));
  }
  return t;
}

}  // namespace

core::Expected<std::vector<PlacedSensor>> sensors_of(const AxisSensors& axis, const PartRules& rules) {
  if (const std::string fault = check_axis(axis, rules); !fault.empty())
    return Status::invalid_argument(fault);
  const Eigen::Vector3d along = axis.to_m - axis.from_m;
  const double length = along.norm();
  const double most = axis.count ? *axis.count : length / rules.pitch_m;
  if (axis.count || most > 1e6) {
    if (const auto fault = check_capacity(most, rules)) return *fault;
  }
  const std::vector<double> t = places(axis, length, rules);
  if (const auto fault = check_capacity(static_cast<double>(t.size()), rules)) return *fault;
  std::vector<PlacedSensor> sensors;
  for (std::size_t k = 0; k < t.size(); ++k) {
    const auto cluster = cluster_at(axis, t[k]);
    const double radius = axis.radius_m.value_or(cluster ? (cluster->reach_vox + 0.5) * rules.voxel_m : 0.0);
    const double share_m = length * (t[k] - (k > 0 ? t[k - 1] : 0.0));
    sensors.push_back(
        {axis.from_m + t[k] * along, 2.0 * std::numbers::pi * radius * share_m, axis.gain, cluster});
  }
  return sensors;
}

}  // namespace phantom::robot::detail

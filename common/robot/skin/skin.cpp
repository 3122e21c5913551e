#include "common/robot/skin/skin.hpp"

#include <algorithm>
#include <cmath>

#include "common/core/text.hpp"
#include "common/robot/skin/skin_parts.hpp"

namespace phantom::robot {
namespace {

using core::Status;
using detail::PlacedSensor;

std::string unknown_link(const SerialArm& arm, const std::string& name) {
  std::string known;
  for (const Link& candidate : arm.links())
    for (const auto& [frame, unused] : candidate.frames) core::add_to_list(known, frame);
  return "skin: link '" + name + "' is not in the arm; allowed: " + known;
}

/// Returns the `cluster_kind` of a cluster, which it adds to the layout's kinds if it is new.
core::Expected<std::uint8_t> kind_of(const std::optional<ClusterSpec>& cluster, SkinLayout& layout) {
  if (!cluster) return std::uint8_t{0};
  const auto found = std::find(layout.clusters.begin(), layout.clusters.end(), *cluster);
  const auto index = static_cast<std::size_t>(found - layout.clusters.begin());
  if (found == layout.clusters.end()) {
    if (index == 255)
      return Status::invalid_argument("skin: has more than the allowed 255 kinds of cluster sensors");
    layout.clusters.push_back(*cluster);
  }
  return static_cast<std::uint8_t>(index + 1);
}

/// Appends the point sensors or, if `clusters`, the cluster sensors; positions are in the link's frame.
Status append(const std::vector<PlacedSensor>& sensors, bool clusters, SkinLayout& layout) {
  for (const PlacedSensor& sensor : sensors) {
    if (sensor.cluster.has_value() != clusters) continue;
    const auto kind = kind_of(sensor.cluster, layout);
    if (!kind) return kind.status();
    layout.x_m.push_back(sensor.position_m.x());
    layout.y_m.push_back(sensor.position_m.y());
    layout.z_m.push_back(sensor.position_m.z());
    layout.closing_m.push_back(sensor.closing_m);
    layout.area_m2.push_back(sensor.area_m2);
    layout.weight.push_back(sensor.gain);  // completed once the link's number of sensors is known
    layout.cluster_kind.push_back(*kind);
  }
  return Status::ok();
}

void complete_weights(std::size_t first, SkinLayout& layout) {
  const double share = 1.0 / static_cast<double>(std::max<std::size_t>(1, layout.size() - first));
  for (std::size_t i = first; i < layout.size(); ++i) {
    if (layout.normalisation == Normalisation::kArea) layout.weight[i] *= layout.area_m2[i];
    if (layout.normalisation == Normalisation::kCount) layout.weight[i] *= share;
  }
}

Eigen::Vector3d closing_of(const MeshSensors& mesh, const LinkSkin&) { return mesh.closing_m; }
template <class Part>
Eigen::Vector3d closing_of(const Part&, const LinkSkin& link) {
  return link.closing_m;
}

/// Adds the sensors of one kind of part to `sensors`, in the link's frame.
template <class Part>
Status add_parts(const std::vector<Part>& parts, const char* kind, const LinkSkin& link, bool on_base,
                 const geometry::Pose& X_link_frame, const SkinOptions& options, std::size_t size_before,
                 std::vector<PlacedSensor>& sensors, std::size_t& left_out) {
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const detail::PartRules rules{
        options.voxel_size_m.reference_m(), options.pitch_vox * options.voxel_size_m.reference_m(),
        options.max_sensors - std::min(options.max_sensors, size_before + sensors.size()),
        options.normalisation};
    auto more = detail::sensors_of(parts[i], rules);
    if (!more) {
      return {more.status().code(), "skin: link '" + link.link + "': " + kind + "[" + std::to_string(i) +
                                        "]: " + more.status().message()};
    }
    if (on_base) {
      ++left_out;
      continue;
    }
    for (PlacedSensor& sensor : *more) {
      sensor.position_m = X_link_frame * sensor.position_m;
      sensor.closing_m = X_link_frame.rotation * closing_of(parts[i], link);
      sensors.push_back(sensor);
    }
  }
  return Status::ok();
}

}  // namespace

std::string detail::check_sensor(double gain, const std::optional<ClusterSpec>& cluster) {
  if (!(gain >= 0.0) || !std::isfinite(gain)) return "gain must be 0 or more";
  if (cluster && (cluster->reach_vox < 1 || cluster->reach_vox > ClusterSpec::kMaxReach_vox)) {
    return "cluster: reach_vox: " + std::to_string(cluster->reach_vox) + "; allowed: 1 to " +
           std::to_string(ClusterSpec::kMaxReach_vox);
  }
  return {};
}

std::optional<Status> detail::check_capacity(double more, const PartRules& rules) {
  if (more <= static_cast<double>(rules.capacity)) return std::nullopt;
  return Status::invalid_argument("needs more sensors than the " + std::to_string(rules.capacity) +
                                  " that are still allowed; widen the pitch or raise the limit");
}

bool place_along_link_axis(const SerialArm& arm, const std::string& link, double offset_m, double length_m,
                           SkinSegment& segment) {
  const auto found = arm.find_frame(link);
  if (!found) return false;
  const auto [start, end] = arm.link_axis_m(found->first);
  const double reach = (end - start).norm();
  const Eigen::Vector3d along =
      reach > 1e-9 ? Eigen::Vector3d((end - start) / reach) : Eigen::Vector3d::UnitZ();
  const geometry::Pose X_frame_link = found->second.inverse();
  segment.from_m = X_frame_link * (start + offset_m * along);
  segment.to_m = X_frame_link * (start + (offset_m + length_m) * along);
  return true;
}

std::optional<std::pair<Eigen::Vector3d, Eigen::Vector3d>> SkinLayout::box_of(std::size_t link) const {
  if (first[link] == first[link + 1]) return std::nullopt;
  std::pair box_m(position(first[link]), position(first[link]));
  for (std::size_t i = first[link]; i < first[link + 1]; ++i)
    for (const Eigen::Vector3d& p_m : {position(i, 0.0), position(i, 1.0)})
      box_m = {box_m.first.cwiseMin(p_m), box_m.second.cwiseMax(p_m)};
  return box_m;
}

std::size_t SkinLayout::link_of(std::size_t sensor) const noexcept {
  std::size_t link = 0;
  while (link < core::kMaxJoints && sensor >= first[link + 1]) ++link;
  return link;
}

core::Expected<SkinLayout> lay_out_skin(const SerialArm& arm, const std::vector<LinkSkin>& skin,
                                        const SkinOptions& options) {
  if (!(options.pitch_vox * options.voxel_size_m.reference_m() > 0.0))
    return Status::invalid_argument("skin: voxel size and pitch must be above 0");
  for (const LinkSkin& link : skin) {
    if (!arm.find_frame(link.link)) return Status::invalid_argument(unknown_link(arm, link.link));
  }
  SkinLayout layout;
  layout.normalisation = options.normalisation;
  layout.voxel_stretch = options.voxel_size_m.stretch();
  for (std::size_t moving = 0; moving < arm.links().size(); ++moving) {
    layout.first[moving] = layout.size();
    std::vector<PlacedSensor> sensors;
    for (const LinkSkin& link : skin) {
      const auto frame = *arm.find_frame(link.link);
      const std::size_t carrier = frame.first;
      const geometry::Pose& X_link_frame = frame.second;
      if (carrier != moving) continue;
      const auto add = [&](const auto& parts, const char* kind) {
        return add_parts(parts, kind, link, moving == 0, X_link_frame, options, layout.size(), sensors,
                         layout.left_out);
      };
      if (Status added = add(link.segments, "segments"); !added) return added;
      if (Status added = add(link.axes, "axes"); !added) return added;
      if (Status added = add(link.meshes, "meshes"); !added) return added;
    }
    if (Status added = append(sensors, false, layout); !added) return added;
    layout.first_cluster[moving] = layout.size();
    if (Status added = append(sensors, true, layout); !added) return added;
    complete_weights(layout.first[moving], layout);
  }
  for (std::size_t rest = arm.links().size(); rest < layout.first.size(); ++rest) {
    layout.first[rest] = layout.size();
    if (rest < layout.first_cluster.size()) layout.first_cluster[rest] = layout.size();
  }
  if (std::all_of(layout.closing_m.begin(), layout.closing_m.end(),
                  [](const Eigen::Vector3d& way_m) { return way_m.isZero(0.0); }))
    layout.closing_m = {};
  if (layout.size() == 0)
    return Status::invalid_argument("skin: no sensors; at least one part on a moving link is needed");
  return layout;
}

}  // namespace phantom::robot

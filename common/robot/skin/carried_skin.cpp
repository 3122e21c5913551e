#include "common/robot/skin/carried_skin.hpp"

#include <algorithm>

#include "common/robot/skin/skin_parts.hpp"

namespace phantom::robot {
namespace {

using core::Status;

/// A body on its moving link.
struct Placed {
  std::size_t link;
  geometry::Pose X_LO;
  const BodySkin* skin;
};

core::Expected<Placed> place(const SerialArm& arm, const CarriedBody& body) {
  const auto frame = arm.find_frame(body.link);
  if (!frame) return Status::invalid_argument("the arm has no link '" + body.link + "'");
  if (frame->first == 0)
    return Status::invalid_argument("link '" + body.link + "' is the arm's base, which does not move");
  return Placed{frame->first, frame->second * body.X_FO, body.skin};
}

/// Appends the own sensors first … end − 1 with their gains: kCount's weights are divided by the link's
/// number of sensors, which is another now.
void append_own(const SkinLayout& own, std::size_t first, std::size_t end, double link_sensors,
                SkinLayout& layout) {
  const double scale = own.normalisation == Normalisation::kCount ? link_sensors : 1.0;
  for (std::size_t i = first; i < end; ++i) {
    layout.x_m.push_back(own.x_m[i]);
    layout.y_m.push_back(own.y_m[i]);
    layout.z_m.push_back(own.z_m[i]);
    layout.area_m2.push_back(own.area_m2[i]);
    layout.weight.push_back(own.weight[i] * scale);
    layout.cluster_kind.push_back(own.cluster_kind[i]);
    if (!own.closing_m.empty()) layout.closing_m.push_back(own.closing_m[i]);
  }
}

// What the fingers hold does not move as they do.
void append_body(const Placed& body, bool has_fingers, SkinLayout& layout) {
  for (std::size_t i = 0; i < body.skin->positions_m.size(); ++i) {
    const Eigen::Vector3d p_m = body.X_LO * body.skin->positions_m[i];
    const double area_m2 = body.skin->areas_m2[i];
    layout.x_m.push_back(p_m.x());
    layout.y_m.push_back(p_m.y());
    layout.z_m.push_back(p_m.z());
    layout.area_m2.push_back(area_m2);
    layout.weight.push_back(layout.normalisation == Normalisation::kArea ? area_m2 : 1.0);
    layout.cluster_kind.push_back(0);
    if (has_fingers) layout.closing_m.emplace_back(Eigen::Vector3d::Zero());
  }
}

}  // namespace

core::Expected<BodySkin> lay_out_body(const geometry::TriangleMesh& mesh_m, const SkinOptions& options) {
  const detail::PartRules rules{options.voxel_size_m.reference_m(),
                                options.pitch_vox * options.voxel_size_m.reference_m(), options.max_sensors,
                                options.normalisation};
  const auto sensors = detail::sensors_of(MeshSensors{.mesh_m = mesh_m, .gain = 1.0, .cluster = {}}, rules);
  if (!sensors) return sensors.status();
  BodySkin skin;
  for (const detail::PlacedSensor& sensor : *sensors) {
    skin.positions_m.push_back(sensor.position_m);
    skin.areas_m2.push_back(sensor.area_m2);
  }
  return skin;
}

core::Expected<SkinLayout> skin_with_bodies(const SerialArm& arm, const SkinLayout& own,
                                            std::span<const CarriedBody> bodies, const SkinOptions& options) {
  std::vector<Placed> placed;
  std::size_t sensors = own.size();
  for (const CarriedBody& body : bodies) {
    auto on_link = place(arm, body);
    if (!on_link) return on_link.status();
    placed.push_back(*on_link);
    sensors += body.skin->positions_m.size();
  }
  if (sensors > options.max_sensors)
    return Status::invalid_argument("the skin has " + std::to_string(sensors) +
                                    " sensors with what is carried; "
                                    "allowed: " +
                                    std::to_string(options.max_sensors));
  SkinLayout layout;
  layout.normalisation = own.normalisation;
  layout.clusters = own.clusters;
  layout.voxel_stretch = own.voxel_stretch;
  layout.left_out = own.left_out;
  for (std::size_t link = 0; link + 1 < own.first.size(); ++link) {
    layout.first[link] = layout.size();
    const std::size_t first = own.first[link], end = own.first[link + 1];
    const std::size_t first_cluster = own.first_cluster[link];
    const auto own_sensors = static_cast<double>(end - first);
    append_own(own, first, first_cluster, own_sensors, layout);
    for (const Placed& body : placed) {
      if (body.link == link) append_body(body, !own.closing_m.empty(), layout);
    }
    layout.first_cluster[link] = layout.size();
    append_own(own, first_cluster, end, own_sensors, layout);
    if (layout.normalisation != Normalisation::kCount) continue;
    const double share =
        1.0 / static_cast<double>(std::max<std::size_t>(1, layout.size() - layout.first[link]));
    for (std::size_t i = layout.first[link]; i < layout.size(); ++i) layout.weight[i] *= share;
  }
  layout.first.back() = layout.size();
  return layout;
}

}  // namespace phantom::robot

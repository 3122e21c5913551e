#include "components/slave_io/force_bounds.hpp"

#include <algorithm>
#include <cmath>

#include "common/core/errors.hpp"
#include "common/runtime/cell/cell_bodies.hpp"

namespace phantom::slave_io {
namespace {

using Place = BoundedPlaces::Place;

/// Returns whether two boxes, each in its frame, are no farther apart than `margin_m` along each of the 15
/// axes that separate boxes. `X_AB`: B's frame in A's.
bool are_near(const Eigen::AlignedBox3d& a, const Eigen::AlignedBox3d& b, const geometry::Pose& X_AB,
              double margin_m) noexcept {
  const Eigen::Vector3d half_a_m = 0.5 * a.sizes(), half_b_m = 0.5 * b.sizes();
  const Eigen::Vector3d way_m = X_AB * b.center() - a.center();
  const Eigen::Matrix3d R = X_AB.rotation;
  // Axes that are nearly parallel have a product of nearly no length, of which this makes the boxes larger.
  constexpr double kNearlyParallel = 1e-9;
  const Eigen::Matrix3d size = (R.cwiseAbs().array() + kNearlyParallel).matrix();
  for (Eigen::Index i = 0; i < 3; ++i)
    if (std::abs(way_m[i]) > half_a_m[i] + size.row(i).dot(half_b_m) + margin_m) return false;
  for (Eigen::Index j = 0; j < 3; ++j)
    if (std::abs(R.col(j).dot(way_m)) > half_b_m[j] + size.col(j).dot(half_a_m) + margin_m) return false;
  for (Eigen::Index i = 0; i < 3; ++i) {
    const Eigen::Index i1 = (i + 1) % 3, i2 = (i + 2) % 3;
    for (Eigen::Index j = 0; j < 3; ++j) {
      const Eigen::Index j1 = (j + 1) % 3, j2 = (j + 2) % 3;
      const double reach_m = half_a_m[i1] * size(i2, j) + half_a_m[i2] * size(i1, j) +
                             half_b_m[j1] * size(i, j2) + half_b_m[j2] * size(i, j1);
      const double length = std::sqrt(std::max(0.0, 1.0 - R(i, j) * R(i, j)));  // of the axis
      if (std::abs(way_m[i2] * R(i1, j) - way_m[i1] * R(i2, j)) > reach_m + length * margin_m) return false;
    }
  }
  return true;
}

}  // namespace

void BoundedPlaces::stand_at(std::size_t index, const geometry::Pose& X_WO) noexcept {
  Object& object = objects[index];
  object.place = Place::kAtPose;
  Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(object.rotation_rows.data()) = X_WO.rotation;
  Eigen::Map<Eigen::Vector3d>(object.translation_m.data()) = X_WO.translation_m;
}

std::vector<ObjectForceBound> object_bounds(const runtime::CellConfig& cell) {
  std::vector<ObjectForceBound> bounds;
  for (const runtime::ObjectConfig& object : cell.objects) {
    if (!(object.max_contact_force_N > 0.0)) continue;
    if (bounds.size() == kMaxBoundedObjects)
      throw core::ConfigError(object.place + ".max_contact_force_N: is one of too many; allowed: " +
                              std::to_string(kMaxBoundedObjects) + " objects of a cell");
    ObjectForceBound bound{object.id, object.name, object.max_contact_force_N, object.pose_error_m, {}, {}};
    if (!object.loose && !object.hold) bound.X_WO = object.X_WO;
    bounds.push_back(std::move(bound));
  }
  return bounds;
}

std::vector<ObjectForceBound> object_bounds_with_boxes(const runtime::CellConfig& cell) {
  std::vector<ObjectForceBound> bounds = object_bounds(cell);
  for (ObjectForceBound& bound : bounds) {
    const auto object = std::ranges::find(cell.objects, bound.object, &runtime::ObjectConfig::id);
    const geometry::BoundingBox box = runtime::load_body(*object, cell).mesh_O.bounding_box();
    bound.box_O_m = {box.min_m.cast<double>(), box.max_m.cast<double>()};
  }
  return bounds;
}

LinkBoxes link_boxes(const robot::SerialArm& arm, const std::vector<robot::LinkSkin>& skin, double voxel_m) {
  constexpr double kPitch_m = 0.02;
  const auto layout = robot::lay_out_skin(
      arm, skin, {.voxel_size_m = kPitch_m, .normalisation = robot::Normalisation::kNone});
  if (!layout) throw core::ConfigError("skin: " + layout.status().message());
  LinkBoxes boxes;
  for (std::size_t link = 0; link <= arm.joint_count(); ++link)
    if (const auto box_m = layout->box_of(link)) boxes[link] = {box_m->first, box_m->second};
  for (const robot::LinkSkin& part : skin) {
    Eigen::AlignedBox3d& box = boxes[arm.find_frame(part.link).value().first];
    double radius_m = 0.0;  // of the link, whose surface is so far from sensors on its axis
    for (const robot::AxisSensors& axis : part.axes) {
      const double zone_m = axis.cluster ? (axis.cluster->reach_vox + 0.5) * voxel_m : 0.0;
      radius_m = std::max(radius_m, axis.radius_m.value_or(zone_m));
    }
    if (!box.isEmpty()) box = {box.min().array() - radius_m, box.max().array() + radius_m};
  }
  return boxes;
}

ForceBounds::ForceBounds(std::vector<ObjectForceBound> objects, const LinkBoxes& links)
    : objects_(std::move(objects)), standing_(objects_.size()), boxes_(links) {
  for (std::size_t link = 0; link < boxes_.size(); ++link)
    if (!boxes_[link].isEmpty()) links_.push_back(link);
  place({});
}

void ForceBounds::place(const BoundedPlaces& places) noexcept {
  carries_ = places.carries;
  for (std::size_t i = 0; i < objects_.size(); ++i) {
    Standing& standing = standing_[i];
    const BoundedPlaces::Object& now = places.objects[i];
    standing.place = now.place;
    if (now.place == Place::kAtPose) {
      standing.X_WO.rotation =
          Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(now.rotation_rows.data());
      standing.X_WO.translation_m = Eigen::Map<const Eigen::Vector3d>(now.translation_m.data());
    } else if (now.place == Place::kAsConfigured) {
      standing.place = objects_[i].X_WO ? Place::kAtPose : Place::kAnywhere;
      if (objects_[i].X_WO) standing.X_WO = *objects_[i].X_WO;
    }
  }
}

bool ForceBounds::may_touch(std::size_t index, const robot::LinkPoses& X_WL) const noexcept {
  const Standing& standing = standing_[index];
  const ObjectForceBound& object = objects_[index];
  if (standing.place == Place::kGone) return false;
  if (carries_ || links_.empty() || standing.place != Place::kAtPose || object.box_O_m.isEmpty()) return true;
  return std::ranges::any_of(links_, [&](std::size_t link) {
    return are_near(boxes_[link], object.box_O_m, X_WL[link].inverse() * standing.X_WO,
                    kReach_m + object.pose_error_m);
  });
}

ForceBounds::Bound ForceBounds::of(std::uint16_t object, const robot::LinkPoses& X_WL) const noexcept {
  if (object != 0) {
    const auto bound = std::ranges::find(objects_, object, &ObjectForceBound::object);
    return bound != objects_.end() ? Bound{bound->force_N, object} : Bound{};
  }
  Bound least;
  for (std::size_t i = 0; i < objects_.size(); ++i) {
    const bool is_less = least.object == 0 || objects_[i].force_N < least.force_N;
    if (is_less && may_touch(i, X_WL)) least = {objects_[i].force_N, objects_[i].object};
  }
  return least;
}

}  // namespace phantom::slave_io

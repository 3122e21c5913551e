#include "common/simulation/loose_objects.hpp"

#include <algorithm>
#include <limits>
#include <stdexcept>

#include "common/robot/skin/carried_skin.hpp"

namespace phantom::simulation {
namespace {

constexpr double kRange_m = 0.02;  // beyond it an object's distance does not matter
// By which a point counts as nearer to those chosen already, per metre that it is less deep than the deepest.
constexpr double kDepthCounts = 50.0;
// What was chosen in the last step counts as so much farther from the others, so that contacts do not swap.
constexpr double kChosenBefore_m = 0.02;
constexpr double kStill_m_s = 5e-4;

/// Corners and points all over the surface; of those the outermost, and then ever those farthest from all
/// chosen so far.
std::vector<Eigen::Vector3d> spread_points(const geometry::TriangleMesh& mesh, double radius_m) {
  std::vector<Eigen::Vector3d> all;
  for (const auto& vertex : mesh.vertices_m) all.push_back(vertex.cast<double>());
  const auto skin = robot::lay_out_body(mesh, {.voxel_size_m = radius_m / 4.0, .pitch_vox = 1.0});
  if (skin) all.insert(all.end(), skin->positions_m.begin(), skin->positions_m.end());
  const geometry::BoundingBox box = mesh.bounding_box();
  const Eigen::Vector3d centre_m = 0.5 * (box.min_m + box.max_m).cast<double>();
  std::vector<double> away_m;
  for (const auto& p : all) away_m.push_back((p - centre_m).norm());
  std::vector<Eigen::Vector3d> chosen;
  for (bool first = true; chosen.size() < std::min(all.size(), LooseObjects::kPointsOfObject);) {
    const auto farthest = std::max_element(away_m.begin(), away_m.end());
    if (*farthest <= 1e-6) break;
    const Eigen::Vector3d p = all[static_cast<std::size_t>(farthest - away_m.begin())];
    chosen.push_back(p);
    for (std::size_t i = 0; i < all.size(); ++i)
      away_m[i] = first ? (all[i] - p).norm() : std::min(away_m[i], (all[i] - p).norm());
    first = false;
  }
  return chosen;
}

}  // namespace

LooseObjects::LooseObjects(std::vector<LooseObject> objects, const ContactWorld& fixed,
                           std::size_t arm_points)
    : fixed_(fixed) {
  for (LooseObject& object : objects) {
    if (object.mesh_O.triangles.empty())
      throw std::runtime_error("simulated world: a loose object has no surface");
    const geometry::BoundingBox box = object.mesh_O.bounding_box();
    const double radius_m = 0.5 * (box.max_m - box.min_m).cast<double>().norm();
    std::vector<Eigen::Vector3d> points = spread_points(object.mesh_O, radius_m);
    const std::size_t count = points.size();
    objects_.push_back({object.id, object.body, MeshWorld({{object.mesh_O, object.id}}, kRange_m),
                        std::move(points), 0.5 * (box.min_m + box.max_m).cast<double>(), radius_m,
                        object.body.X_WO, 0.0, std::vector<Seen>(count), std::vector<Seen>(arm_points)});
  }
  near_.reserve(std::max(arm_points, kPointsOfObject));
  pairs_.reserve(objects_.size() * (kOnArm + kOnFixed + kOnOther * objects_.size()));
  last_pairs_.reserve(pairs_.capacity());
}

std::vector<LooseBody> LooseObjects::bodies() const {
  std::vector<LooseBody> bodies;
  for (const Object& object : objects_) bodies.push_back(object.body);
  return bodies;
}

void LooseObjects::near_fixed(std::size_t index, double reach_m) noexcept {
  Object& object = objects_[index];
  for (std::uint32_t i = 0; i < object.points_O_m.size(); ++i) {
    const Eigen::Vector3d p_W_m = object.X_WO * object.points_O_m[i];
    if (object.seen_W[i].is_farther(p_W_m, reach_m)) continue;
    const double distance_m = fixed_.distance_m(p_W_m);
    object.seen_W[i] = {p_W_m, distance_m};
    if (distance_m < reach_m)
      near_.push_back({{static_cast<std::int32_t>(index), Pair::kFixed, i}, p_W_m, distance_m});
  }
}

void LooseObjects::near_object(std::int32_t owner, std::uint32_t point, const Eigen::Vector3d& p_W_m,
                               std::size_t index, double reach_m) noexcept {
  Object& object = objects_[index];
  const double far_m = object.radius_m + reach_m;
  if ((p_W_m - object.X_WO * object.centre_O_m).squaredNorm() > far_m * far_m) return;
  const Eigen::Vector3d p_O_m = object.X_WO.inverse() * p_W_m;
  const bool of_arm = owner == Pair::kArm;
  if (of_arm && object.arm_O[point].is_farther(p_O_m, reach_m)) return;
  const double distance_m = object.surface_O.distance_m(p_O_m);
  if (of_arm) object.arm_O[point] = {p_O_m, distance_m};
  if (distance_m < reach_m && near_.size() < near_.capacity())
    near_.push_back({{owner, static_cast<std::int32_t>(index), point}, p_W_m, distance_m});
}

// Keeps the deepest of the near points, and ever the one farthest from those kept, as long as it is not much
// less deep.
void LooseObjects::keep(std::size_t most) noexcept {
  if (near_.empty()) return;
  const auto less_deep = [](const Near& a, const Near& b) { return a.distance_m < b.distance_m; };
  const double deepest_m = std::min_element(near_.begin(), near_.end(), less_deep)->distance_m;
  for (std::size_t kept = 0; kept < std::min(most, near_.size()); ++kept) {
    std::size_t best = kept;
    double best_score = -std::numeric_limits<double>::infinity();
    for (std::size_t i = kept; i < near_.size(); ++i) {
      double apart_m = kept == 0 ? 0.0 : 1e9;
      for (std::size_t k = 0; k < kept; ++k)
        apart_m = std::min(apart_m, (near_[i].p_W_m - near_[k].p_W_m).norm());
      const double score = apart_m - kDepthCounts * (near_[i].distance_m - deepest_m) +
                           (was_chosen(near_[i].pair) ? kChosenBefore_m : 0.0);
      if (score <= best_score) continue;
      best = i;
      best_score = score;
    }
    std::swap(near_[kept], near_[best]);
    pairs_.push_back(near_[kept].pair);
  }
  near_.clear();
}

bool LooseObjects::was_chosen(const Pair& pair) const noexcept {
  return std::find(last_pairs_.begin(), last_pairs_.end(), pair) != last_pairs_.end();
}

void LooseObjects::take_speed(std::size_t object, double speed_m_s, double dt_s) noexcept {
  double& still_s = objects_[object].still_s;
  still_s = speed_m_s < kStill_m_s ? still_s + dt_s : 0.0;
}

// Points of the one in the surface of the other; what does not rest keeps the other awake.
void LooseObjects::near_one_another(std::size_t index, std::size_t other, double reach_m) noexcept {
  Object &a = objects_[index], &b = objects_[other];
  const double far_m = a.radius_m + b.radius_m + reach_m;
  if ((a.X_WO * a.centre_O_m - b.X_WO * b.centre_O_m).squaredNorm() > far_m * far_m) return;
  for (std::uint32_t i = 0; i < a.points_O_m.size(); ++i)
    near_object(static_cast<std::int32_t>(index), i, a.X_WO * a.points_O_m[i], other, reach_m);
  if (!near_.empty()) a.still_s = b.still_s = std::min(a.still_s, b.still_s);
  keep(kOnOther);
}

void LooseObjects::choose(std::span<const ArmPoint> arm, double reach_m) noexcept {
  std::swap(last_pairs_, pairs_);
  pairs_.clear();
  for (std::size_t index = 0; index < objects_.size(); ++index) {
    for (std::uint32_t i = 0; i < arm.size(); ++i) near_object(Pair::kArm, i, arm[i].p_W_m, index, reach_m);
    if (!near_.empty()) objects_[index].still_s = 0.0;
    keep(kOnArm);
  }
  for (std::size_t index = 0; index < objects_.size(); ++index) {
    for (std::size_t other = 0; other < objects_.size(); ++other)
      if (other != index && !(rests(index) && rests(other))) near_one_another(index, other, reach_m);
    if (rests(index)) continue;
    near_fixed(index, reach_m);
    keep(kOnFixed);
  }
}

bool LooseObjects::touches(const Pair& pair, const Eigen::Vector3d& arm_point_W_m,
                           Touch& touch) const noexcept {
  touch.pair = pair;
  touch.point_W_m = arm_point_W_m;
  if (pair.owner != Pair::kArm) {
    const Object& owner = objects_[static_cast<std::size_t>(pair.owner)];
    touch.point_W_m = owner.X_WO * owner.points_O_m[pair.point];
  }
  ContactQuery found;
  if (pair.surface == Pair::kFixed) {
    found = fixed_.query(touch.point_W_m);
  } else {
    const Object& body = objects_[static_cast<std::size_t>(pair.surface)];
    found = body.surface_O.query(body.X_WO.inverse() * touch.point_W_m);
    found.normal_W = body.X_WO.rotation * found.normal_W;
  }
  if (found.distance_m >= 0.0 || found.normal_W.isZero()) return false;
  touch.object = found.object;
  touch.normal_W = found.normal_W;
  touch.depth_m = -found.distance_m;
  return true;
}

}  // namespace phantom::simulation

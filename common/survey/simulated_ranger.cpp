#include "common/survey/simulated_ranger.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/core/text.hpp"
#include "common/geometry/ray_triangle.hpp"

namespace phantom::survey {
namespace {

double stepped(double value, double step) { return step > 0.0 ? step * std::round(value / step) : value; }

/// Returns points spread evenly over a disc of radius 1 (Vogel's spiral), the first in the middle.
std::vector<Eigen::Vector2d> disc_points(int count) {
  const double turn_rad = std::numbers::pi * (3.0 - std::sqrt(5.0));
  std::vector<Eigen::Vector2d> points;
  for (int i = 0; i < count; ++i) {
    const double radius = std::sqrt(static_cast<double>(i) / count), at_rad = turn_rad * i;
    points.emplace_back(radius * std::cos(at_rad), radius * std::sin(at_rad));
  }
  return points;
}

}  // namespace

RangerScene::RangerScene(const geometry::TriangleMesh& mesh_W) : tree_(geometry::triangle_boxes(mesh_W)) {
  for (const std::uint32_t item : tree_.items()) {
    auto& corners = triangles_m_.emplace_back();
    for (std::size_t k = 0; k < 3; ++k)
      corners[k] = mesh_W.vertices_m[mesh_W.triangles[item][k]].cast<double>();
  }
}

std::optional<RangerScene::Hit> RangerScene::nearest(const Eigen::Vector3d& from_W_m,
                                                     const Eigen::Vector3d& direction_W,
                                                     double max_range_m) const {
  std::optional<Hit> hit;
  double to = max_range_m;
  tree_.along_ray(from_W_m, direction_W, 0.0, to, [&](std::uint32_t place) {
    const auto& [a, b, c] = triangles_m_[place];
    const auto at = geometry::ray_meets_triangle(from_W_m, direction_W, a, b, c);
    if (!at || *at < 0.0 || *at > to) return;
    to = *at;
    hit = Hit{*at, std::abs((b - a).cross(c - a).normalized().dot(direction_W))};
  });
  return hit;
}

SimulatedRanger::SimulatedRanger(const RangeHead& head, const HeadErrors& errors, RangerScene scene,
                                 std::uint64_t seed, const RangerOptions& options)
    : head_(head), errors_(errors), scene_(std::move(scene)), options_(options), random_(seed) {
  aim(0.0, std::numbers::pi / 2);
}

Reading SimulatedRanger::aim(double pan_rad, double tilt_rad) {
  reported_ = {0.0, stepped(pan_rad, options_.angle_step_rad), stepped(tilt_rad, options_.angle_step_rad)};
  const double steady = 1.0 - options_.jitter;
  pan_off_rad_ = steady * draw_error(errors_.law, errors_.pan_rad, random_);
  tilt_off_rad_ = steady * draw_error(errors_.law, errors_.tilt_rad, random_);
  return reported_;
}

core::Expected<Reading> SimulatedRanger::measure() {
  Reading axis = reported_;
  axis.pan_rad += pan_off_rad_ + options_.jitter * draw_error(errors_.law, errors_.pan_rad, random_);
  axis.tilt_rad += tilt_off_rad_ + options_.jitter * draw_error(errors_.law, errors_.tilt_rad, random_);
  const auto range_m = footprint_range_m(axis);
  if (!range_m) return core::Status(core::ErrorCode::kUnavailable, "no echo");
  Reading reading = reported_;
  reading.range_m = *range_m;
  reading.range_m += draw_error(errors_.law, range_bound_m(errors_, reading), random_);
  reading.range_m = stepped(reading.range_m, options_.range_step_m);
  if (reading.range_m < head_.min_range_m || reading.range_m > head_.max_range_m)
    return core::Status(core::ErrorCode::kUnavailable,
                        core::formatted("the echo is from %.3f m; allowed: %g to %g m", reading.range_m,
                                        head_.min_range_m, head_.max_range_m));
  return reading;
}

/// Returns the mean range over the spot, weighted by the returned light; none without an echo. Rays leave the
/// ranger in a cone: at a range they are as far from the axis as the spot is wide there.
std::optional<double> SimulatedRanger::footprint_range_m(const Reading& axis) const {
  Reading at_ranger = axis, far = axis;
  at_ranger.range_m = 0.0;
  far.range_m = 1.0;  // the direction is the same at each
  const Eigen::Vector3d beam = beam_direction_W(head_, far);
  const Eigen::Vector3d from =
      head_.beam_offset_m > 0.0 ? spot_W_m(head_, at_ranger) : head_.X_WH.translation_m;
  const Eigen::Vector3d across = beam.unitOrthogonal(), along = beam.cross(across);
  double light = 0.0, sum_m = 0.0;
  for (const Eigen::Vector2d& p : disc_points(options_.rays)) {
    const Eigen::Vector3d off = p.x() * across + p.y() * along;
    const auto hit = scene_.nearest(from + errors_.spot_m * off,
                                    (beam + errors_.spot_per_m * off).normalized(), 2.0 * head_.max_range_m);
    if (!hit) continue;
    light += hit->cosine;
    sum_m += hit->cosine * hit->range_m;
  }
  if (light < options_.least_echo * options_.rays) return std::nullopt;
  return sum_m / light;
}

}  // namespace phantom::survey

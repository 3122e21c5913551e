#include "common/survey/error_aid.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "common/core/text.hpp"
#include "common/core/units.hpp"
#include "common/geometry/symmetric_matrix.hpp"

namespace phantom::survey {
namespace {

using core::formatted;

constexpr std::size_t kMaxSuspects = 3;

/// Calls `take` with every choice of `count` of the indices 0 … n − 1.
template <class Take>
void for_each_choice(std::size_t n, std::size_t count, const Take& take) {
  std::vector<bool> chosen(n, false);
  std::fill_n(chosen.begin(), count, true);
  do {
    std::vector<std::size_t> choice;
    for (std::size_t i = 0; i < n; ++i)
      if (chosen[i]) choice.push_back(i);
    take(choice);
  } while (std::prev_permutation(chosen.begin(), chosen.end()));
}

std::vector<std::size_t> without(const MeasuredFace& face, const std::vector<std::size_t>& left_out) {
  std::vector<std::size_t> rest;
  for (std::size_t i = 0; i < face.nodes.size(); ++i) {
    if (std::find(left_out.begin(), left_out.end(), i) == left_out.end()) rest.push_back(face.nodes[i]);
  }
  return rest;
}

/// Returns the sets of `count` corners without which the others lie on a plane, the likeliest first.
std::vector<std::vector<std::size_t>> explanations(const Measurement& measurement, const MeasuredFace& face,
                                                   std::size_t count) {
  std::vector<std::pair<double, std::vector<std::size_t>>> found;
  for_each_choice(face.nodes.size(), count, [&](const std::vector<std::size_t>& choice) {
    const Plane plane = fit_plane(measurement, without(face, choice));
    const double probability = plane.degrees > 0 ? chi_square_tail(plane.chi2, plane.degrees) : 1.0;
    if (probability >= kSuspicion) found.emplace_back(probability, choice);
  });
  std::stable_sort(found.begin(), found.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
  std::vector<std::vector<std::size_t>> sets;
  for (auto& [probability, choice] : found) sets.push_back(std::move(choice));
  return sets;
}

/// Returns the variance of a fitted plane's height at a point.
double height_variance(const Plane& plane, const Eigen::Vector3d& p_m) {
  const Eigen::Vector3d from = p_m - plane.point_m, by(1.0, from.dot(plane.axis_u), from.dot(plane.axis_v));
  return by.dot(plane.covariance * by);
}

void compare_with(const Plane& plane, const Measurement& measurement, bool in_the_plane, NodeCheck& check) {
  const MeasuredNode& node = measurement.nodes[check.node];
  const double along = plane.normal.dot(node.beam_W);
  const double off_m = plane.normal.dot(node.p_W_m - plane.point_m);
  const double own = plane.normal.dot(node.covariance_m2 * plane.normal),
               of_plane = height_variance(plane, node.p_W_m);
  // A corner pulls the fitted plane towards itself; one that was left out does not.
  const double variance = in_the_plane ? std::max(own - of_plane, 0.0) : own + of_plane;
  // The lower bound is for a beam that grazes the face, whose range says nothing about the plane.
  const double steep = std::max(std::abs(along), 1e-3);
  check.off_plane_m = off_m / (along < 0 ? -steep : steep);
  check.sigma_m = std::sqrt(variance) / steep;
}

void note_normals(const Measurement& measurement, const MeasuredFace& face, FaceCheck& check) {
  const auto corners = corners_of(measurement, face);
  const std::size_t n = corners.size();
  for (std::size_t i = face.closed ? 0 : 1; i < (face.closed ? n : n - 1); ++i) {
    const Eigen::Vector3d normal =
        (corners[i] - corners[(i + n - 1) % n]).cross(corners[(i + 1) % n] - corners[i]);
    if (normal.norm() == 0) continue;
    // The absolute value is for the corners of notches, which turn the other way.
    const double cosine = std::abs(normal.normalized().dot(check.normal));
    check.nodes[i].normal_departs_rad = std::acos(std::min(cosine, 1.0));
  }
}

}  // namespace

Plane fit_plane(const Measurement& measurement, const std::vector<std::size_t>& nodes) {
  std::vector<Eigen::Vector3d> places;
  for (const std::size_t node : nodes) places.push_back(measurement.nodes[node].p_W_m);
  Plane plane;
  plane.normal = triangle_normal(places, largest_triangle(places), measurement.eye_W_m);
  plane.degrees = static_cast<int>(nodes.size()) - 3;
  for (const Eigen::Vector3d& p : places) plane.point_m += p / static_cast<double>(places.size());
  for (int round = 0; round < 6; ++round) {
    plane.axis_u = plane.normal.unitOrthogonal();
    plane.axis_v = plane.normal.cross(plane.axis_u);
    Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
    Eigen::Vector3d pull = Eigen::Vector3d::Zero();
    plane.chi2 = 0.0;
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      const Eigen::Vector3d from = places[i] - plane.point_m;
      const double weight = 1.0 / plane.normal.dot(measurement.nodes[nodes[i]].covariance_m2 * plane.normal);
      const double height = plane.normal.dot(from);
      const Eigen::Vector3d by(1.0, from.dot(plane.axis_u), from.dot(plane.axis_v));
      information += weight * by * by.transpose();
      pull += weight * height * by;
      plane.chi2 += weight * height * height;
    }
    plane.covariance = geometry::inverse_symmetric(information);
    const Eigen::Vector3d step = plane.covariance * pull;
    plane.point_m += step[0] * plane.normal;
    plane.normal = (plane.normal - step[1] * plane.axis_u - step[2] * plane.axis_v).normalized();
    if (step.norm() < 1e-12) break;
  }
  return plane;
}

Departure departure_from(const Plane& plane, const MeasuredNode& node) {
  const double variance =
      plane.normal.dot(node.covariance_m2 * plane.normal) + height_variance(plane, node.p_W_m);
  return {plane.normal.dot(node.p_W_m - plane.point_m), std::sqrt(variance)};
}

FaceCheck check_face(const Measurement& measurement, const MeasuredFace& face) {
  FaceCheck check;
  const std::size_t n = face.nodes.size();
  Plane plane = fit_plane(measurement, face.nodes);
  check.redundant = n > 3;
  std::vector<std::size_t> suspects;
  if (check.redundant) {
    check.plane_probability = chi_square_tail(plane.chi2, plane.degrees);
    for (std::size_t count = 1;
         check.plane_probability < kSuspicion && count <= std::min(kMaxSuspects, n - 3); ++count) {
      auto sets = explanations(measurement, face, count);
      if (sets.empty()) continue;
      suspects = sets.front();
      check.alternatives.assign(sets.begin() + 1, sets.end());
      plane = fit_plane(measurement, without(face, suspects));
      break;
    }
  }
  check.normal = plane.normal;
  for (std::size_t i = 0; i < n; ++i) {
    NodeCheck node;
    node.node = face.nodes[i];
    node.suspect = std::find(suspects.begin(), suspects.end(), i) != suspects.end();
    compare_with(plane, measurement, !node.suspect, node);
    check.nodes.push_back(node);
  }
  note_normals(measurement, face, check);
  return check;
}

std::vector<std::string> advice(const Measurement& measurement, const MeasuredFace& face,
                                const FaceCheck& check) {
  std::vector<std::string> said;
  const auto name = [&](std::size_t place) { return measurement.nodes[face.nodes[place]].name; };
  const bool any =
      std::any_of(check.nodes.begin(), check.nodes.end(), [](const NodeCheck& node) { return node.suspect; });
  if (check.plane_probability < kSuspicion && !any) {
    said.push_back("face '" + face.name +
                   "': its corners lie on no plane, and no few of them explain it; "
                   "measure the face again, or is it plane at all?");
    return said;
  }
  for (const NodeCheck& node : check.nodes) {
    if (!node.suspect) continue;
    said.push_back("measure node '" + measurement.nodes[node.node].name + "' again: its range is " +
                   formatted("%.1f mm too %s for the plane of face '", 1e3 * std::abs(node.off_plane_m),
                             node.off_plane_m > 0 ? "long" : "short") +
                   face.name +
                   formatted("' (errors: %.1f mm), its normal departs by %.1f deg", 1e3 * node.sigma_m,
                             node.normal_departs_rad / core::kRadPerDegree));
  }
  if (check.alternatives.empty()) return said;
  std::string others;
  for (const auto& set : check.alternatives) {
    std::string together;
    for (const std::size_t place : set) together += (together.empty() ? "" : " with ") + name(place);
    core::add_to_list(others, together);
  }
  said.push_back("or, explaining it as well: " + others + "; a further corner of this face would tell which");
  return said;
}

}  // namespace phantom::survey

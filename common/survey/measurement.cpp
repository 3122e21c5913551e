#include "common/survey/measurement.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <map>
#include <unsupported/Eigen/SpecialFunctions>

#include "common/core/text.hpp"

namespace phantom::survey {
namespace {

using core::formatted;
using core::Status;

// Readings of one corner contradict each other if their probability is below this.
constexpr double kContradiction = 1e-5;
constexpr double kOneSpot_sigmas = 2.0;  // corners nearer than this cannot be told apart
constexpr double kInLine_sigmas = 4.0;   // below this height of a triangle, its corners may be in line

using Normals = std::map<std::string, Eigen::Vector3d>;  // unit, in W, by the face's name

/// Registers readings in the order in which they come, and averages those of one corner.
class Registration {
 public:
  /// `normals`: of the faces as far as they are known; null: of none, and readings of a corner are averaged
  /// although they contradict each other, to find them.
  Registration(const RangeHead& head, const HeadErrors& errors, const Normals* normals)
      : head_(head), errors_(errors), normals_(normals) {
    measurement_.eye_W_m = head.X_WH.translation_m;
    measurement_.mounting_covariance = mounting_covariance(errors);
  }

  Status take(const Targeting& targeting) {
    const std::string about =
        (targeting.place.empty() ? "" : targeting.place + ": ") + "node '" + targeting.node + "': ";
    const auto [known, is_new] = node_of_.try_emplace(targeting.node, measurement_.nodes.size());
    if (!targeting.reading) {
      if (is_new)
        return Status::invalid_argument(
            about + "has no reading; allowed: none only for a node that was measured before");
      return put_on_face(targeting, known->second, about);
    }
    const Reading& reading = *targeting.reading;
    if (auto checked = check_reading(head_, reading); !checked)
      return Status::invalid_argument(about + checked.message());
    MeasuredNode node{targeting.node, spot_W_m(head_, reading), covariance_m2(targeting.face, reading),
                      beam_direction_W(head_, reading), 1};
    if (is_new) {
      measurement_.nodes.push_back(std::move(node));
      last_.push_back(reading);
    } else if (!(reading == last_[known->second])) {
      last_[known->second] = reading;
      if (auto merged = merge(measurement_.nodes[known->second], node, about); !merged) return merged;
    }
    return put_on_face(targeting, known->second, about);
  }

  Measurement done() && { return std::move(measurement_); }

 private:
  Eigen::Matrix3d covariance_m2(const std::string& face, const Reading& reading) const {
    if (normals_ != nullptr)
      if (const auto known = normals_->find(face); known != normals_->end())
        return spot_covariance_m2(head_, errors_, reading, known->second);
    return spot_covariance_unknown_face_m2(head_, errors_, reading);
  }

  Status merge(MeasuredNode& node, const MeasuredNode& again, const std::string& about) const {
    const Eigen::Vector3d apart = again.p_W_m - node.p_W_m;
    const Eigen::Matrix3d both = node.covariance_m2 + again.covariance_m2;
    if (normals_ != nullptr && chi_square_tail(apart.dot(both.inverse() * apart), 3) < kContradiction) {
      return Status::invalid_argument(
          about + formatted("measured again %.1f mm away, more than its errors explain; allowed: "
                            "the same corner, or another name",
                            1e3 * apart.norm()));
    }
    const Eigen::Matrix3d gain = node.covariance_m2 * both.inverse();
    node.p_W_m += gain * apart;
    node.covariance_m2 -= gain * node.covariance_m2.eval();
    node.covariance_m2 = 0.5 * (node.covariance_m2 + node.covariance_m2.transpose().eval());
    ++node.times;
    return {};
  }

  Status put_on_face(const Targeting& targeting, std::size_t node, const std::string& about) {
    const auto [known, is_new] = face_of_.try_emplace(targeting.face, measurement_.faces.size());
    if (is_new) measurement_.faces.push_back({targeting.face, targeting.closed, {}});
    MeasuredFace& face = measurement_.faces[known->second];
    if (face.closed != targeting.closed)
      return Status::invalid_argument(about + "face '" + face.name +
                                      "' is whole in one row and a part in another; allowed: one of them");
    // The corner is already on its face: it was measured again, or the border returned to its start.
    if (std::find(face.nodes.begin(), face.nodes.end(), node) == face.nodes.end()) face.nodes.push_back(node);
    return {};
  }

  const RangeHead& head_;
  const HeadErrors& errors_;
  const Normals* normals_;
  Measurement measurement_;
  std::map<std::string, std::size_t> node_of_, face_of_;
  std::vector<Reading> last_;  // for each node
};

/// The triangle's least height, and its standard deviation.
struct Height {
  double m = 0.0, sigma_m = 0.0;
};
Height least_height(const Measurement& measurement, const MeasuredFace& face, const CornerTriangle& t) {
  std::array<const MeasuredNode*, 3> node{};
  for (std::size_t i = 0; i < 3; ++i) node[i] = &measurement.nodes[face.nodes[t[i]]];
  std::size_t longest = 0;
  std::array<double, 3> side_m{};
  for (std::size_t i = 0; i < 3; ++i) {
    side_m[i] = (node[(i + 1) % 3]->p_W_m - node[i]->p_W_m).norm();
    if (side_m[i] > side_m[longest]) longest = i;
  }
  const MeasuredNode &a = *node[longest], &b = *node[(longest + 1) % 3], &c = *node[(longest + 2) % 3];
  if (side_m[longest] == 0) return {};
  const Eigen::Vector3d along = (b.p_W_m - a.p_W_m) / side_m[longest];
  const double share = (c.p_W_m - a.p_W_m).dot(along) / side_m[longest];
  const Eigen::Vector3d up = c.p_W_m - a.p_W_m - share * side_m[longest] * along;
  const double height_m = up.norm();
  if (height_m == 0) return {};
  const Eigen::Vector3d u = up / height_m;
  const auto variance = [&u](const MeasuredNode& n) { return u.dot(n.covariance_m2 * u); };
  return {height_m,
          std::sqrt(variance(c) + (1 - share) * (1 - share) * variance(a) + share * share * variance(b))};
}

core::Expected<Measurement> registered(const RangeHead& head, const HeadErrors& errors,
                                       const std::vector<Targeting>& targetings, const Normals* normals) {
  Registration registration(head, errors, normals);
  for (const Targeting& targeting : targetings) {
    if (auto taken = registration.take(targeting); !taken) return taken;
  }
  return std::move(registration).done();
}

/// Returns the normals of the faces whose corners determine one.
Normals normals_of(const Measurement& measurement) {
  Normals normals;
  for (const MeasuredFace& face : measurement.faces) {
    if (face.nodes.size() < 3) continue;
    const auto corners = corners_of(measurement, face);
    const CornerTriangle triangle = largest_triangle(corners);
    const Height height = least_height(measurement, face, triangle);
    if (height.m > kInLine_sigmas * height.sigma_m)
      normals[face.name] = triangle_normal(corners, triangle, measurement.eye_W_m);
  }
  return normals;
}

}  // namespace

core::Expected<Measurement> register_nodes(const RangeHead& head, const HeadErrors& errors,
                                           const std::vector<Targeting>& targetings) {
  const auto rough = registered(head, errors, targetings, nullptr);
  if (!rough) return rough;
  const Normals normals = normals_of(*rough);
  return registered(head, errors, targetings, &normals);
}

Status check_measurement(const Measurement& measurement) {
  const auto& nodes = measurement.nodes;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      const double apart_m = (nodes[i].p_W_m - nodes[k].p_W_m).norm(),
                   sigma_m = distance_sigma_m(nodes[i], nodes[k]);
      if (apart_m > kOneSpot_sigmas * sigma_m) continue;
      return Status::invalid_argument(
          "nodes '" + nodes[k].name + "' and '" + nodes[i].name +
          formatted("' are on one spot: %.1f mm apart; allowed: more than their error, %.1f mm",
                    1e3 * apart_m, 1e3 * kOneSpot_sigmas * sigma_m));
    }
  }
  for (const MeasuredFace& face : measurement.faces) {
    const std::string about = "face '" + face.name + "' ";
    if (face.nodes.size() < (face.closed ? 3U : 2U)) {
      return Status::invalid_argument(
          about + formatted("has %zu corners; allowed: at least %d", face.nodes.size(), face.closed ? 3 : 2) +
          (face.closed ? ", or 2 of a part of a face" : ""));
    }
    if (face.nodes.size() < 3) continue;
    const auto triangle = largest_triangle(corners_of(measurement, face));
    const Height height = least_height(measurement, face, triangle);
    if (height.m > kInLine_sigmas * height.sigma_m) continue;
    const auto name = [&](std::size_t node) { return nodes[node].name; };
    return Status::invalid_argument(
        about + "has all its corners in one line (" + core::listed(face.nodes, name) +
        formatted("): they span %.1f mm across; allowed: more than their error, %.1f mm", 1e3 * height.m,
                  1e3 * kInLine_sigmas * height.sigma_m));
  }
  return {};
}

FaceMetrics face_metrics(const std::vector<Eigen::Vector3d>& corners, bool closed,
                         const Eigen::Vector3d& eye_m) {
  FaceMetrics metrics;
  const std::size_t n = corners.size();
  Eigen::Vector3d twice_area = Eigen::Vector3d::Zero(), middle = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& corner : corners) middle += corner / static_cast<double>(n);
  for (std::size_t i = 0; i < n; ++i) {
    const Eigen::Vector3d& next = corners[(i + 1) % n];
    if (closed || i + 1 < n) metrics.edge_m.push_back((next - corners[i]).norm());
    twice_area += (corners[i] - middle).cross(next - middle);
  }
  metrics.area_m2 = 0.5 * twice_area.norm();
  if (metrics.area_m2 > 0) {
    metrics.counter_clockwise = twice_area.dot(eye_m - middle) >= 0;
    metrics.normal = (metrics.counter_clockwise ? 1.0 : -1.0) * twice_area.normalized();
  }
  metrics.angle_rad.assign(n, 0.0);
  metrics.turn_rad.assign(n, 0.0);
  for (std::size_t i = closed ? 0 : 1; i < (closed ? n : n - 1); ++i) {
    const Eigen::Vector3d in = corners[i] - corners[(i + n - 1) % n], out = corners[(i + 1) % n] - corners[i];
    metrics.angle_rad[i] = std::atan2(in.cross(out).norm(), -in.dot(out));
    metrics.turn_rad[i] = std::atan2(metrics.normal.dot(in.cross(out)), in.dot(out));
  }
  return metrics;
}

std::vector<Eigen::Vector3d> corners_of(const Measurement& measurement, const MeasuredFace& face) {
  std::vector<Eigen::Vector3d> corners;
  for (const std::size_t node : face.nodes) corners.push_back(measurement.nodes[node].p_W_m);
  return corners;
}

CornerTriangle largest_triangle(const std::vector<Eigen::Vector3d>& corners) {
  CornerTriangle best{0, 1, 2};
  double greatest = -1.0;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    for (std::size_t k = i + 1; k < corners.size(); ++k) {
      for (std::size_t l = k + 1; l < corners.size(); ++l) {
        const double area = (corners[k] - corners[i]).cross(corners[l] - corners[i]).squaredNorm();
        if (area <= greatest) continue;
        greatest = area;
        best = {i, k, l};
      }
    }
  }
  return best;
}

Eigen::Vector3d triangle_normal(const std::vector<Eigen::Vector3d>& corners, const CornerTriangle& t,
                                const Eigen::Vector3d& eye_m) {
  const Eigen::Vector3d n = (corners[t[1]] - corners[t[0]]).cross(corners[t[2]] - corners[t[0]]);
  if (n.norm() == 0) return Eigen::Vector3d::Zero();
  return (n.dot(eye_m - corners[t[0]]) < 0 ? -1.0 : 1.0) * n.normalized();
}

double distance_sigma_m(const MeasuredNode& a, const MeasuredNode& b) {
  const Eigen::Matrix3d both = a.covariance_m2 + b.covariance_m2;
  const Eigen::Vector3d apart = b.p_W_m - a.p_W_m;
  const double distance_m = apart.norm();
  // At zero distance there is no direction: take the mean over all directions.
  if (distance_m == 0) return std::sqrt(both.trace() / 3.0);
  const Eigen::Vector3d along = apart / distance_m;
  return std::sqrt(along.dot(both * along));
}

double chi_square_tail(double chi2, int degrees) {
  return chi2 > 0 ? Eigen::numext::igammac(0.5 * degrees, 0.5 * chi2) : 1.0;
}

}  // namespace phantom::survey

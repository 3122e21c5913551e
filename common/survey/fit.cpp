#include "common/survey/fit.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <random>

#include "common/core/text.hpp"
#include "common/geometry/cross_matrix.hpp"
#include "common/geometry/symmetric_matrix.hpp"

namespace phantom::survey {
namespace {

using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Vector6 = Eigen::Matrix<double, 6, 1>;

constexpr int kMaxRounds = 50;
constexpr int kRandomPoses = 4000;

Eigen::Matrix<double, 3, 6> lever(const Eigen::Vector3d& from_centre) {
  Eigen::Matrix<double, 3, 6> J;
  J << -geometry::cross_matrix(from_centre), Eigen::Matrix3d::Identity();
  return J;
}

void move(geometry::Pose& X, const Eigen::Vector3d& centre, const Vector6& by) {
  const Eigen::Matrix3d R = geometry::rotation_from_vector(by.head<3>());
  X.translation_m = centre + R * (X.translation_m - centre) + by.tail<3>();
  X.rotation = geometry::rotation_from_quaternion(geometry::quaternion_xyzw(R * X.rotation));
}

/// Normal equations of the mapped nodes at a pose.
struct Equations {
  Matrix6 information = Matrix6::Zero();
  Vector6 pull = Vector6::Zero();
  double chi2 = 0.0;
};
Equations equations_at(const PartModel& part, const Measurement& measurement, const NodeMap& map,
                       const PoseFit& fit, const std::vector<Eigen::Matrix3d>& weights) {
  Equations e;
  for (std::size_t k = 0; k < fit.nodes.size(); ++k) {
    const Eigen::Vector3d p = fit.X_WO * part.nodes_O_m[map[fit.nodes[k]]];
    const Eigen::Vector3d residual = measurement.nodes[fit.nodes[k]].p_W_m - p;
    const auto J = lever(p - fit.centre_W_m);
    e.information += J.transpose() * weights[k] * J;
    e.pull += J.transpose() * weights[k] * residual;
    e.chi2 += residual.dot(weights[k] * residual);
  }
  return e;
}

/// Returns the spread of points across their line of best fit and along it, in m.
std::pair<double, double> spread(const std::vector<Eigen::Vector3d>& points) {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : points) middle += p / static_cast<double>(points.size());
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& p : points) scatter += (p - middle) * (p - middle).transpose();
  const Eigen::Vector3d values = geometry::symmetric_eigenvalues(scatter);
  return {std::sqrt(std::max(values[1], 0.0)), std::sqrt(std::max(values[2], 0.0))};
}

}  // namespace

double PoseFit::position_sigma_m() const {
  return std::sqrt(geometry::symmetric_eigenvalues(Eigen::Matrix3d(covariance.bottomRightCorner<3, 3>()))[2]);
}

double PoseFit::orientation_sigma_rad() const {
  return std::sqrt(geometry::symmetric_eigenvalues(Eigen::Matrix3d(covariance.topLeftCorner<3, 3>()))[2]);
}

geometry::Pose fit_four_steps(const PartModel& part, const Measurement& measurement, const MeasuredFace& face,
                              const NodeMap& map, const CornerTriangle& triangle, std::size_t anchor) {
  const auto measured = corners_of(measurement, face);
  std::vector<Eigen::Vector3d> modelled;
  for (const std::size_t node : face.nodes) modelled.push_back(part.nodes_O_m[map[node]]);
  const Eigen::Vector3d wanted = triangle_normal(measured, triangle, measurement.eye_W_m);
  // The model's normal comes from the same corners, so that both face the same way for any shape of polygon.
  Eigen::Vector3d own = (modelled[triangle[1]] - modelled[triangle[0]])
                            .cross(modelled[triangle[2]] - modelled[triangle[0]])
                            .normalized();
  const Eigen::Vector3d as_measured =
      (measured[triangle[1]] - measured[triangle[0]]).cross(measured[triangle[2]] - measured[triangle[0]]);
  if (as_measured.dot(wanted) < 0) own = -own;
  geometry::Pose X;
  X.rotation = geometry::rotation_between(own, wanted);
  double sine = 0.0, cosine = 0.0;
  for (std::size_t i = 0; i + (face.closed ? 0 : 1) < measured.size(); ++i) {
    const std::size_t next = (i + 1) % measured.size();
    const Eigen::Vector3d is = measured[next] - measured[i],
                          have = X.rotation * (modelled[next] - modelled[i]);
    sine += wanted.dot(have.cross(is));
    cosine += have.dot(is) - wanted.dot(have) * wanted.dot(is);
  }
  X.rotation = geometry::rotation_about(wanted, std::atan2(sine, cosine)) * X.rotation;
  X.translation_m = measured[anchor] - X.rotation * modelled[anchor];
  return X;
}

std::size_t best_anchor(const Measurement& measurement, const MeasuredFace& face) {
  const auto error = [&](std::size_t node) { return measurement.nodes[node].covariance_m2.trace(); };
  const auto best = std::min_element(face.nodes.begin(), face.nodes.end(),
                                     [&](std::size_t a, std::size_t b) { return error(a) < error(b); });
  return static_cast<std::size_t>(best - face.nodes.begin());
}

geometry::Pose rigid_fit(const std::vector<Eigen::Vector3d>& from, const std::vector<Eigen::Vector3d>& to) {
  const auto n = static_cast<Eigen::Index>(from.size());
  const Eigen::Map<const Eigen::Matrix3Xd> a(from.data()->data(), 3, n), b(to.data()->data(), 3, n);
  const Eigen::Matrix4d X = Eigen::umeyama(a, b, false);
  return {X.topLeftCorner<3, 3>(), X.topRightCorner<3, 1>()};
}

core::Expected<PoseFit> refine(const PartModel& part, const Measurement& measurement, const NodeMap& map,
                               const geometry::Pose& start) {
  PoseFit fit;
  fit.X_WO = start;
  std::vector<Eigen::Matrix3d> weights;
  std::vector<Eigen::Vector3d> places;
  for (std::size_t i = 0; i < map.size(); ++i) {
    if (map[i] == kNotMapped) continue;
    fit.nodes.push_back(i);
    weights.push_back(measurement.nodes[i].covariance_m2.inverse());
    places.push_back(part.nodes_O_m[map[i]]);
  }
  if (fit.nodes.size() < 3)
    return core::Status::invalid_argument(core::formatted(
        "%zu nodes do not determine a pose; allowed: three or more, not in line", fit.nodes.size()));
  const auto [across_m, along_m] = spread(places);
  if (across_m < 1e-6 * along_m)
    return core::Status::invalid_argument(
        "nodes in one line do not determine a pose: the part may turn about it; "
        "allowed: a node beside the line");
  for (const std::size_t node : fit.nodes)
    fit.centre_W_m += measurement.nodes[node].p_W_m / static_cast<double>(fit.nodes.size());
  for (int round = 0; round < kMaxRounds; ++round) {
    const Equations e = equations_at(part, measurement, map, fit, weights);
    const Vector6 step = geometry::solve_symmetric(e.information, e.pull);
    if (!step.allFinite()) return core::Status::invalid_argument("the nodes do not determine a pose");
    move(fit.X_WO, fit.centre_W_m, step);
    if (step.norm() < 1e-12) break;
  }
  const Equations e = equations_at(part, measurement, map, fit, weights);
  fit.covariance = geometry::inverse_symmetric(e.information);
  fit.chi2 = e.chi2;
  fit.degrees = 3 * static_cast<int>(fit.nodes.size()) - 6;
  for (const std::size_t node : fit.nodes)
    fit.residual_W_m.push_back(measurement.nodes[node].p_W_m - fit.X_WO * part.nodes_O_m[map[node]]);
  return fit;
}

Matrix6 mounting_covariance_of(const PoseFit& fit, const Measurement& measurement) {
  Matrix6 J = Matrix6::Identity();
  J.bottomRows<3>() = lever(fit.centre_W_m - measurement.eye_W_m);
  return J * measurement.mounting_covariance * J.transpose();
}

Eigen::Matrix<double, 3, 6> displacement_jacobian(const PoseFit& fit, const Eigen::Vector3d& p_W_m) {
  return lever(p_W_m - fit.centre_W_m);
}

double worst_displacement_m(const PartModel& part, const PoseFit& fit, double confidence) {
  const Matrix6 root = geometry::square_root(fit.covariance);
  std::mt19937_64 random(20170611);
  std::normal_distribution<double> normal;
  std::vector<Eigen::Vector3d> levers;
  for (const Eigen::Vector3d& p : part.extremes_O_m) levers.push_back(fit.X_WO * p - fit.centre_W_m);
  std::vector<double> worst_m;
  for (int i = 0; i < kRandomPoses; ++i) {
    Vector6 z;
    for (int k = 0; k < 6; ++k) z[k] = normal(random);
    const Vector6 error = root * z;
    double square = 0.0;
    for (const Eigen::Vector3d& l : levers)
      square = std::max(square, (error.head<3>().cross(l) + error.tail<3>()).squaredNorm());
    worst_m.push_back(std::sqrt(square));
  }
  // The rank is one standard error above the confidence, so that the random sample does not make the bound
  // look better than it is.
  const double rank = kRandomPoses * confidence + std::sqrt(kRandomPoses * confidence * (1 - confidence));
  const auto at = worst_m.begin() + static_cast<std::ptrdiff_t>(std::min(rank, kRandomPoses - 1.0));
  std::nth_element(worst_m.begin(), at, worst_m.end());
  return *at;
}

double displacement_between_m(const PartModel& part, const geometry::Pose& model_WO,
                              const geometry::Pose& true_WO) {
  double worst_m = 0.0;
  for (const Eigen::Vector3d& p : part.extremes_O_m)
    worst_m = std::max(worst_m, (model_WO * p - true_WO * p).norm());
  return worst_m;
}

int guard_voxels(double displacement_m, const workspace::VoxelSize& voxel_size_m) {
  constexpr double kRounding = 1e-9;
  double reach_m = 0.0;
  for (const double side_m : voxel_size_m.sides_m())
    reach_m = std::max(reach_m, side_m * std::ceil(displacement_m / side_m - kRounding));
  return static_cast<int>(std::ceil(reach_m / voxel_size_m.reference_m() - kRounding));
}

std::vector<Misfit> find_misfits(const PartModel& part, const Measurement& measurement, const NodeMap& map,
                                 const PoseFit& fit, double least_probability) {
  std::vector<Misfit> misfits;
  for (const std::size_t node : fit.nodes) {
    NodeMap rest = map;
    rest[node] = kNotMapped;
    const auto without = refine(part, measurement, rest, fit.X_WO);
    if (!without || without->degrees <= 0 || without->probability() < least_probability) continue;
    const Eigen::Vector3d off = measurement.nodes[node].p_W_m - without->X_WO * part.nodes_O_m[map[node]];
    misfits.push_back({node, off.norm(), off.dot(measurement.nodes[node].beam_W), without->probability()});
  }
  std::stable_sort(misfits.begin(), misfits.end(),
                   [](const Misfit& a, const Misfit& b) { return a.rest_probability > b.rest_probability; });
  return misfits;
}

}  // namespace phantom::survey

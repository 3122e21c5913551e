#include "common/camera/pose_fit.hpp"

#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <string>

#include "common/core/text.hpp"
#include "common/geometry/symmetric_matrix.hpp"

namespace phantom::camera {
namespace {

using geometry::Pose;
using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

constexpr double kMinSpread = 0.01;  // of points: second singular value over the first
constexpr double kSamePosition = 1e-3, kSameTurn_rad = 1e-3;  // of two solutions; position over the distance
constexpr std::size_t kMaxStarts = 8;                         // points of which all triples are tried
constexpr double kExact_px2 = 1e-6;
constexpr double kWorstCondition = 1e13;

Pose moved(const Pose& X_WC, const Vector6& by) {
  return X_WC * Pose{geometry::rotation_from_vector(by.head<3>()), by.tail<3>()};
}

bool same(const Pose& a, const Pose& b, double distance_m) {
  return (a.translation_m - b.translation_m).norm() < kSamePosition * distance_m &&
         geometry::rotation_vector(a.rotation.transpose() * b.rotation).norm() < kSameTurn_rad;
}

/// Returns the sum of squared residuals; infinite if a point is not seen at all.
double cost(const LensModel& lens, const Pose& X_WC, std::span<const SeenPoint> points) {
  const Pose X_CW = X_WC.inverse();
  double sum = 0.0;
  for (const SeenPoint& point : points) {
    const auto pixel = lens.project(X_CW * point.position_W_m);
    if (!pixel) return std::numeric_limits<double>::infinity();
    sum += (point.pixel - *pixel).squaredNorm();
  }
  return sum;
}

struct Normal {
  Matrix6 JtJ = Matrix6::Zero();
  Vector6 Jtr = Vector6::Zero();
};

Normal normal_equations(const LensModel& lens, const Pose& X_WC, std::span<const SeenPoint> points) {
  Normal normal;
  const Pose X_CW = X_WC.inverse();
  for (const SeenPoint& point : points) {
    const auto pixel = lens.project(X_CW * point.position_W_m);
    if (!pixel) continue;
    const Eigen::Matrix<double, 2, 6> J = pixel_by_pose(lens, X_WC, point.position_W_m);
    normal.JtJ += J.transpose() * J;
    normal.Jtr += J.transpose() * (point.pixel - *pixel);
  }
  return normal;
}

/// Moves a pose to the nearest minimum (Levenberg-Marquardt). Returns its cost.
double refine_pose(const LensModel& lens, std::span<const SeenPoint> points, Pose& X_WC) {
  double now = cost(lens, X_WC, points), damping = 1e-6;
  for (int step = 0; step < 200 && std::isfinite(now) && damping < 1e12; ++step) {
    const Normal normal = normal_equations(lens, X_WC, points);
    Matrix6 damped = normal.JtJ;
    damped.diagonal() *= 1 + damping;
    const Vector6 by = geometry::solve_symmetric(damped, normal.Jtr);
    if (!by.allFinite()) break;
    const Pose tried = moved(X_WC, by);
    const double then = cost(lens, tried, points);
    if (then <= now) {
      const bool done = by.norm() < 1e-13 || now - then < 1e-14 * (1 + now);
      X_WC = tried;
      now = then;
      damping = std::max(1e-12, damping / 10);
      if (done) break;
    } else {
      damping *= 10;
    }
  }
  return now;
}

struct Solution {
  Pose X_WC;
  double cost_px2 = 0.0;
};

Eigen::Vector3d middle_of(std::span<const SeenPoint> points) {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const SeenPoint& point : points) middle += point.position_W_m / static_cast<double>(points.size());
  return middle;
}

bool in_line(std::span<const SeenPoint> points) {
  const Eigen::Vector3d middle = middle_of(points);
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const SeenPoint& point : points)
    scatter += (point.position_W_m - middle) * (point.position_W_m - middle).transpose();
  const Eigen::Vector3d square = geometry::symmetric_eigenvalues(scatter);
  return !(square(2) > 0.0) || square(1) < kMinSpread * kMinSpread * square(2);
}

/// Returns the points of which triples give starting poses: all, or some that lie far apart.
std::vector<SeenPoint> far_apart(std::span<const SeenPoint> points) {
  std::vector<SeenPoint> chosen(points.begin(), points.end());
  if (chosen.size() <= kMaxStarts) return chosen;
  chosen.clear();
  const Eigen::Vector3d middle = middle_of(points);
  while (chosen.size() < kMaxStarts) {
    const auto distance = [&](const SeenPoint& point) {
      double least =
          chosen.empty() ? (point.position_W_m - middle).norm() : std::numeric_limits<double>::infinity();
      for (const SeenPoint& other : chosen)
        least = std::min(least, (point.position_W_m - other.position_W_m).norm());
      return least;
    };
    chosen.push_back(*std::ranges::max_element(points, {}, distance));
  }
  return chosen;
}

/// Returns the distinct local minima that are reached from every three of the points, the best first.
std::vector<Solution> solutions_of(const LensModel& lens, std::span<const SeenPoint> points,
                                   const std::optional<Pose>& prior) {
  std::vector<Pose> starts;
  const std::vector<SeenPoint> of = far_apart(points);
  for (std::size_t a = 0; a < of.size(); ++a)
    for (std::size_t b = a + 1; b < of.size(); ++b)
      for (std::size_t c = b + 1; c < of.size(); ++c)
        for (const Pose& pose : poses_of_three(lens, {of[a], of[b], of[c]})) starts.push_back(pose);
  if (prior) starts.push_back(*prior);
  const Eigen::Vector3d middle = middle_of(points);
  std::vector<Solution> found;
  for (Pose& start : starts) {
    const double sum = refine_pose(lens, points, start);
    if (!std::isfinite(sum)) continue;
    const double distance_m = (start.translation_m - middle).norm();
    if (std::ranges::none_of(found,
                             [&](const Solution& known) { return same(known.X_WC, start, distance_m); }))
      found.push_back({start, sum});
  }
  std::ranges::sort(found, {}, &Solution::cost_px2);
  return found;
}

/// Returns how far a pose is from the prior, the distance to the points being the unit of length.
double away(const Pose& pose, const Pose& prior, double distance_m) {
  return (pose.translation_m - prior.translation_m).norm() / distance_m +
         geometry::rotation_vector(pose.rotation.transpose() * prior.rotation).norm();
}

core::Status refused(std::string why) { return core::Status::invalid_argument(std::move(why)); }

/// Fills in what the pose means, and how sure it is.
core::Expected<PoseFit> described(const LensModel& lens, std::span<const SeenPoint> points,
                                  const PoseFitOptions& options, const Solution& solution, int solutions) {
  PoseFit fit;
  fit.X_WC = solution.X_WC;
  fit.solutions = solutions;
  const Pose X_CW = fit.X_WC.inverse();
  const auto count = static_cast<double>(points.size());
  for (const SeenPoint& point : points) {
    const Eigen::Vector3d p_C_m = X_CW * point.position_W_m;
    fit.residual_px.push_back((point.pixel - *lens.project(p_C_m)).norm());
    fit.distance_m += p_C_m.norm() / count;
  }
  fit.rms_px = std::sqrt(solution.cost_px2 / count);
  fit.rms_mm = 1e3 * fit.rms_px * fit.distance_m / std::sqrt(lens.lens().fx_px * lens.lens().fy_px);
  const Matrix6 JtJ = normal_equations(lens, fit.X_WC, points).JtJ;
  // Turn and shift have different units: the points' distance makes them comparable.
  Vector6 unit;
  unit << 1, 1, 1, fit.distance_m, fit.distance_m, fit.distance_m;
  const Vector6 strength =
      geometry::symmetric_eigenvalues(Matrix6(unit.asDiagonal() * JtJ * unit.asDiagonal()));
  if (!(strength(0) > strength(5) / kWorstCondition))
    return refused("the points do not determine the pose: they are in line, or all in one place");
  const double freedom = 2 * count - 6;
  const double sigma_px =
      std::max(options.pixel_sigma_px, freedom > 0 ? std::sqrt(solution.cost_px2 / freedom) : 0.0);
  fit.covariance = sigma_px * sigma_px * geometry::inverse_symmetric(JtJ);
  return fit;
}

double greatest_sigma(const Eigen::Matrix3d& covariance) {
  return std::sqrt(std::max(0.0, geometry::symmetric_eigenvalues(covariance)(2)));
}

}  // namespace

double PoseFit::position_sigma_m() const { return greatest_sigma(covariance.bottomRightCorner<3, 3>()); }
double PoseFit::orientation_sigma_rad() const { return greatest_sigma(covariance.topLeftCorner<3, 3>()); }

std::vector<Pose> poses_of_three(const LensModel& lens, const std::array<SeenPoint, 3>& points) {
  if (in_line(points)) return {};
  std::vector<cv::Point3d> places;
  std::vector<cv::Point2d> directions;
  for (const SeenPoint& point : points) {
    const auto n = lens.direction(point.pixel);
    if (!n) return {};
    places.emplace_back(point.position_W_m.x(), point.position_W_m.y(), point.position_W_m.z());
    directions.emplace_back(n->x(), n->y());
  }
  std::vector<cv::Mat> turns, shifts;
  cv::solveP3P(places, directions, cv::Matx33d::eye(), cv::noArray(), turns, shifts, cv::SOLVEPNP_AP3P);
  // Among what the polynomial gives are the real parts of complex roots: only what explains the picture
  // counts.
  std::vector<Pose> poses;
  const double distance_m = (points[0].position_W_m - points[1].position_W_m).norm();
  for (std::size_t i = 0; i < turns.size(); ++i) {
    const Eigen::Vector3d turn(turns[i].at<double>(0), turns[i].at<double>(1), turns[i].at<double>(2));
    const Eigen::Vector3d shift(shifts[i].at<double>(0), shifts[i].at<double>(1), shifts[i].at<double>(2));
    if (!turn.allFinite() || !shift.allFinite()) continue;
    Pose X_WC = Pose{geometry::rotation_from_vector(turn), shift}.inverse();
    if (!(refine_pose(lens, points, X_WC) < kExact_px2)) continue;
    if (std::ranges::none_of(poses, [&](const Pose& known) { return same(known, X_WC, distance_m); }))
      poses.push_back(X_WC);
  }
  return poses;
}

Eigen::Matrix<double, 2, 6> pixel_by_pose(const LensModel& lens, const Pose& X_WC,
                                          const Eigen::Vector3d& position_W_m) {
  // p_C = (turn θ, shift d)⁻¹ of p, so that ∂p_C/∂θ = [p_C]×, ∂p_C/∂d = −1.
  const Eigen::Vector3d p = X_WC.inverse() * position_W_m;
  Eigen::Matrix<double, 3, 6> moved_by;
  moved_by << 0, -p.z(), p.y(), -1, 0, 0, p.z(), 0, -p.x(), 0, -1, 0, -p.y(), p.x(), 0, 0, 0, -1;
  return lens.jacobian(p) * moved_by;
}

core::Expected<PoseFit> fit_pose(const LensModel& lens, std::span<const SeenPoint> points,
                                 const PoseFitOptions& options) {
  if (points.size() < 3)
    return refused("a pose needs three points, there are " + std::to_string(points.size()));
  for (const SeenPoint& point : points)
    if (!point.position_W_m.allFinite() || !point.pixel.allFinite())
      return refused("a point has a coordinate that is no number");
  if (in_line(points))
    return refused("the points lie in line, or in one place: they do not determine a pose");
  std::vector<Solution> found = solutions_of(lens, points, options.prior);
  if (found.empty()) return refused("from no pose are these points seen where they were picked");
  const double rms_px = std::sqrt(found.front().cost_px2 / static_cast<double>(points.size()));
  if (rms_px > options.largest_rms_px)
    return refused(core::formatted(
        "the points do not fit: residual %.1f px; allowed: %.1f px. A point was picked wrongly, or the "
        "lens is another one",
        rms_px, options.largest_rms_px));
  // Another pose counts as likely as the best one unless it is clearly worse than picking explains.
  const double count = static_cast<double>(points.size());
  const double variance = std::max(options.pixel_sigma_px * options.pixel_sigma_px,
                                   found.front().cost_px2 / std::max(1.0, 2 * count - 6));
  const double likely = found.front().cost_px2 + 12 * variance;
  const auto end = std::ranges::find_if(found, [&](const Solution& s) { return s.cost_px2 > likely; });
  found.erase(end, found.end());
  const int solutions = static_cast<int>(found.size());
  if (!options.prior && points.size() == 3)
    return refused(core::formatted(
        "three points allow up to four poses, these %d: pick a fourth one, or give a rough pose",
        std::max(1, solutions)));
  if (!options.prior && solutions > 1)
    return refused(
        core::formatted("the points are explained by %d poses about as well: pick one that lies out of their "
                        "plane, or give a rough pose",
                        solutions));
  if (options.prior) {
    const Eigen::Vector3d middle = middle_of(points);
    const double distance_m = (options.prior->translation_m - middle).norm() + 1e-6;
    const auto off = [&](const Solution& s) { return away(s.X_WC, *options.prior, distance_m); };
    std::ranges::sort(found, {}, off);
    if (found.size() > 1 && off(found[1]) < 1.5 * off(found[0]))
      return refused("two poses are about as near to the rough pose: pick a further point");
  }
  return described(lens, points, options, found.front(), solutions);
}

}  // namespace phantom::camera

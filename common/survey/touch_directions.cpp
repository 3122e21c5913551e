#include <Eigen/Geometry>
#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

#include "common/core/text.hpp"
#include "common/core/units.hpp"
#include "common/geometry/symmetric_matrix.hpp"
#include "common/survey/touch.hpp"

namespace phantom::survey {
namespace {

using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Vector6 = Eigen::Matrix<double, 6, 1>;
using Basis = Eigen::Matrix<double, 6, Eigen::Dynamic>;
using core::formatted;

constexpr double kQuantile = 2.5;     // sigmas that count as a bound
constexpr double kByTouch = 0.5;      // of the prior's variance: what is left where touches say more than it
constexpr double kShift = 0.02;       // of a unit vector: less turn than this is a shift
constexpr double kAlongAxis = 0.995;  // cosine from which a direction is called by its axis
constexpr double kPitch_m_per_rad = 3e-3;  // less shift along the axis of a turn than this is left unsaid

Eigen::Vector3d displacement_W_m(const Vector6& motion, const Eigen::Vector3d& centre_W_m,
                                 const Eigen::Vector3d& p_W_m) {
  return motion.head<3>().cross(p_W_m - centre_W_m) + motion.tail<3>();
}

double greatest_m(const Vector6& motion, const Eigen::Vector3d& centre_W_m,
                  const std::vector<Eigen::Vector3d>& extremes_W_m) {
  double most_m = 0.0;
  for (const Eigen::Vector3d& p : extremes_W_m)
    most_m = std::max(most_m, displacement_W_m(motion, centre_W_m, p).norm());
  return most_m;
}

Vector6 prior_of(const TouchOptions& options) {
  Vector6 prior;
  prior << Eigen::Vector3d::Constant(options.prior_orientation_sigma_rad),
      Eigen::Vector3d::Constant(options.prior_position_sigma_m);
  return prior;
}

std::string axis_words(const Eigen::Vector3d& axis) {
  const char* const names[] = {"x", "y", "z"};
  for (int i = 0; i < 3; ++i)
    if (std::abs(axis[i]) > kAlongAxis) return names[i];
  return formatted("(%.2f %.2f %.2f)", axis.x(), axis.y(), axis.z());
}

/// Any small motion is a turn about some axis with a shift along it, or a shift alone (Chasles).
std::string words_of(const Vector6& motion, double sigma_m, const Eigen::Vector3d& centre_W_m) {
  const Eigen::Vector3d turn = motion.head<3>(), shift = motion.tail<3>();
  const double angle = turn.norm();
  if (std::abs(sigma_m - shift.norm()) < kShift * shift.norm())
    return formatted("shift along %s of W, %.1f mm", axis_words(shift.normalized()).c_str(),
                     1e3 * shift.norm());
  const Eigen::Vector3d through_m = centre_W_m + turn.cross(shift) / (angle * angle);
  const double pitch_m_per_rad = turn.dot(shift) / (angle * angle);
  std::string text =
      formatted("turn about %s of W through (%.3f %.3f %.3f) m, %.2f deg or %.1f mm at the worst point",
                axis_words(turn / angle).c_str(), through_m.x(), through_m.y(), through_m.z(),
                angle / core::kRadPerDegree, 1e3 * sigma_m);
  if (std::abs(pitch_m_per_rad) > kPitch_m_per_rad)
    text += formatted(", with %.1f mm along it per degree", 1e3 * pitch_m_per_rad * core::kRadPerDegree);
  return text;
}

/// Takes unit vectors out of a basis, each as near as the rest allows to one of the axes `first` … `first`
/// + 2.
std::vector<Vector6> along_axes(Basis basis, int first) {
  std::vector<Vector6> taken;
  while (basis.cols() > 0) {
    Eigen::Index best = 0;
    basis.middleRows(first, 3).rowwise().norm().maxCoeff(&best);
    const Eigen::VectorXd within = basis.row(first + best).transpose();
    if (within.norm() < 1e-9) break;
    taken.push_back((basis * within).normalized());
    const Eigen::MatrixXd q = Eigen::HouseholderQR<Eigen::MatrixXd>(within).householderQ();
    basis = (basis * q.rightCols(basis.cols() - 1)).eval();
  }
  return taken;
}

/// A basis of the same space: shifts first, both along the axes of W as far as the space allows.
std::vector<Vector6> readable(const Basis& basis) {
  if (basis.cols() == 0) return {};
  const Eigen::JacobiSVD<Eigen::MatrixXd> turns(basis.topRows<3>(), Eigen::ComputeFullV);
  Eigen::Index turning = 0;
  while (turning < turns.singularValues().size() && turns.singularValues()[turning] > kShift) ++turning;
  auto ways = along_axes(basis * turns.matrixV().rightCols(basis.cols() - turning), 3);
  for (const Vector6& way : along_axes(basis * turns.matrixV().leftCols(turning), 0)) ways.push_back(way);
  return ways;
}

}  // namespace

void split_directions(const Matrix6& information, const Eigen::Vector3d& centre_W_m,
                      const std::vector<Eigen::Vector3d>& extremes_W_m, const TouchOptions& options,
                      std::vector<TouchDirection>& determined, std::vector<TouchDirection>& open) {
  const Vector6 prior = prior_of(options);
  // In units of the prior: without touches every direction has a variance of 1, with them 1/(1 + λ).
  const Matrix6 in_priors = prior.asDiagonal() * information * prior.asDiagonal();
  const geometry::Eigensystem6 ways = geometry::symmetric_eigensystem(in_priors);
  const Matrix6 variance = ways.vectors *
                           (1.0 + ways.values.cwiseMax(0.0).array()).inverse().matrix().asDiagonal() *
                           ways.vectors.transpose();
  const auto direction = [&](const Vector6& way) {
    TouchDirection d;
    d.motion = std::sqrt(way.dot(variance * way)) * prior.cwiseProduct(way);
    d.sigma_m = greatest_m(d.motion, centre_W_m, extremes_W_m);
    d.words = words_of(d.motion, d.sigma_m, centre_W_m);
    return d;
  };
  std::vector<std::pair<double, Vector6>> by_sigma;
  for (int i = 0; i < 6; ++i)
    by_sigma.emplace_back(direction(ways.vectors.col(i)).sigma_m, ways.vectors.col(i));
  std::sort(by_sigma.begin(), by_sigma.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  Basis known(6, 0), unknown(6, 0);
  std::vector<double> square_m2(extremes_W_m.size(), 0.0);  // of each point, by all that is known
  for (const auto& [sigma_m, way] : by_sigma) {
    const Vector6 motion = direction(way).motion;
    const bool by_touch = way.dot(variance * way) < kByTouch;
    double worst_m2 = 0.0;
    for (std::size_t i = 0; by_touch && i < extremes_W_m.size(); ++i) {
      square_m2[i] += displacement_W_m(motion, centre_W_m, extremes_W_m[i]).squaredNorm();
      worst_m2 = std::max(worst_m2, square_m2[i]);
    }
    Basis& to = by_touch && kQuantile * std::sqrt(worst_m2) <= options.determined_m ? known : unknown;
    to.conservativeResize(6, to.cols() + 1);
    to.rightCols<1>() = way;
  }
  for (const Vector6& way : readable(known)) determined.push_back(direction(way));
  for (const Vector6& way : readable(unknown)) open.push_back(direction(way));
}

geometry::Pose determined_pose(const TouchCorrection& correction, const Eigen::Vector3d& centre_O_m,
                               const TouchOptions& options) {
  const geometry::Pose &model_WO = correction.model_WO, &fitted_WO = correction.fit.X_WO;
  Vector6 motion;
  motion << geometry::rotation_vector(fitted_WO.rotation * model_WO.rotation.transpose()),
      fitted_WO * centre_O_m - model_WO * centre_O_m;
  // The directions are orthogonal in units of the prior.
  const Vector6 prior = prior_of(options), whole = motion.cwiseQuotient(prior);
  Vector6 known = Vector6::Zero();
  for (const TouchDirection& direction : correction.determined) {
    const Vector6 way = direction.motion.cwiseQuotient(prior).normalized();
    known += way.dot(whole) * way;
  }
  known = known.cwiseProduct(prior);
  geometry::Pose X_WO;
  X_WO.rotation = geometry::rotation_from_vector(known.head<3>()) * model_WO.rotation;
  X_WO.translation_m = model_WO * centre_O_m + known.tail<3>() - X_WO.rotation * centre_O_m;
  return X_WO;
}

double displacement_in_m(const std::vector<TouchDirection>& directions, const Vector6& motion,
                         const Eigen::Vector3d& centre_W_m, const std::vector<Eigen::Vector3d>& extremes_W_m,
                         const TouchOptions& options) {
  const Vector6 prior = prior_of(options), in_priors = motion.cwiseQuotient(prior);
  Vector6 within = Vector6::Zero();
  for (const TouchDirection& direction : directions) {
    const Vector6 way = direction.motion.cwiseQuotient(prior).normalized();
    within += way.dot(in_priors) * way;
  }
  return greatest_m(prior.cwiseProduct(within), centre_W_m, extremes_W_m);
}

}  // namespace phantom::survey

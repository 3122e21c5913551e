#include "common/survey/touch.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <random>

#include "common/core/text.hpp"
#include "common/core/units.hpp"
#include "common/geometry/symmetric_matrix.hpp"

namespace phantom::survey {
namespace {

using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Vector6 = Eigen::Matrix<double, 6, 1>;
using core::formatted;

constexpr int kStarts = 40;
constexpr int kTouchRounds = 80;
constexpr double kWidestGate_m = 0.05;  // in which all touches count at first
constexpr double kOneSpot_m = 0.004;    // touches that lie closer together are of one spot
constexpr double kNarrowing = 0.75;     // of the gate, from round to round

/// One gap between a ball and the model, and how it changes with the pose.
struct Gap {
  double gap_m = 0.0;
  double in_sigmas = 0.0;
  Vector6 slope = Vector6::Zero();  // ∂in_sigmas/∂(θ, d)
  bool any = true;                  // false: no surface faces as felt
};

/// The problem: the most probable motion (θ, d) of the model about its middle.
class TouchProblem {
 public:
  TouchProblem(const TouchSurface& surface, const geometry::Pose& model_WO, const std::vector<Touch>& touches,
               const std::vector<FreePlace>& free, const TouchOptions& options)
      : surface_(surface), model_WO_(model_WO), touches_(touches), free_(free), options_(options) {
    prior_ << Eigen::Vector3d::Constant(options.prior_orientation_sigma_rad),
        Eigen::Vector3d::Constant(options.prior_position_sigma_m);
    middle_W_m_ = model_WO * surface.centre_O_m();
    for (Touch& touch : touches_) {
      // Touches of one spot share the errors of tool, encoders and model: together they count as one.
      const auto same = std::count_if(touches.begin(), touches.end(), [&](const Touch& other) {
        return (other.p_W_m - touch.p_W_m).norm() < kOneSpot_m;
      });
      touch.sigma_m *= std::sqrt(static_cast<double>(same));
      least_sigma_m_ = std::min(least_sigma_m_, touch.sigma_m);
    }
  }

  /// A minimum of the cost. By Laplace's approximation its share of the probability is exp(−mass/2), up to a
  /// factor that all have in common: a narrow minimum beside a wide one of the same depth is less probable.
  struct Solution {
    Vector6 motion = Vector6::Zero();
    double mass = 0.0;
    geometry::Pose X_WO;
  };

  geometry::Pose moved(const Vector6& motion) const {
    const Eigen::Matrix3d R = geometry::rotation_from_vector(motion.head<3>());
    return {R * model_WO_.rotation,
            middle_W_m_ + R * (model_WO_.translation_m - middle_W_m_) + motion.tail<3>()};
  }
  Eigen::Vector3d middle_W_m(const Vector6& motion) const { return middle_W_m_ + motion.tail<3>(); }

  Gap gap(const Touch& touch, const Vector6& motion) const {
    const geometry::Pose X_OW = moved(motion).inverse();
    const Eigen::Vector3d p_O_m = X_OW * touch.p_W_m;
    if (!touch.normal_W) return gap_to(surface_.nearest(p_O_m), touch.radius_m, touch.sigma_m, motion);
    const auto place =
        surface_.nearest_facing(p_O_m, X_OW.rotation * *touch.normal_W, std::cos(options_.normal_cone_rad));
    if (!place) return {.gap_m = kWidestGate_m, .in_sigmas = 1e9, .any = false};
    return gap_to(*place, touch.radius_m, touch.sigma_m, motion);
  }
  Gap gap(const FreePlace& place, const Vector6& motion) const {
    Gap gap = gap_to(surface_.nearest(moved(motion).inverse() * place.p_W_m), place.radius_m, place.sigma_m,
                     motion);
    if (gap.gap_m < 0) return gap;
    return {.gap_m = gap.gap_m};
  }

  /// Finds the nearest minimum from a start: Gauss–Newton with the touches' weights after Geman and McClure,
  /// whose width narrows from all touches to the gate. At last touches count fully or not at all.
  Solution solve(Vector6 motion) const {
    double width = kWidestGate_m / least_sigma_m_;
    for (int round = 0; round < kTouchRounds; ++round) {
      width = std::max(width * kNarrowing, options_.gate_sigmas);
      const bool at_last = width == options_.gate_sigmas;
      Matrix6 information = posterior(Matrix6::Zero());
      Vector6 pull = -information * motion;
      const auto take = [&](const Gap& gap, double weight) {
        information += weight * gap.slope * gap.slope.transpose();
        pull -= weight * gap.in_sigmas * gap.slope;
      };
      for (const Touch& touch : touches_) {
        const Gap found = gap(touch, motion);
        const double share = found.in_sigmas / width;
        const double soft = 1.0 / (1.0 + share * share);
        if (found.any) take(found, at_last ? (std::abs(share) <= 1.0 ? 1.0 : 0.0) : soft * soft);
      }
      for (const FreePlace& place : free_) take(gap(place, motion), 1.0);
      const Vector6 step = geometry::solve_symmetric(information, pull);
      motion += step;
      if (at_last && step.norm() < 1e-10) break;
    }
    return {motion, cost(motion) + geometry::log_determinant(posterior(information(motion))), moved(motion)};
  }

  double cost(const Vector6& motion) const {
    double sum = motion.cwiseQuotient(prior_).squaredNorm();
    for (const Touch& touch : touches_)
      sum += std::pow(std::min(std::abs(gap(touch, motion).in_sigmas), options_.gate_sigmas), 2);
    for (const FreePlace& place : free_) sum += std::pow(gap(place, motion).in_sigmas, 2);
    return sum;
  }

  /// Returns the minima, the most probable first.
  std::vector<Solution> solve_all() const {
    std::mt19937_64 random(20170611);
    std::normal_distribution<double> normal;
    std::vector<Solution> found{solve(Vector6::Zero())};
    for (int start = 0; start < kStarts; ++start) {
      Vector6 motion;
      for (int i = 0; i < 6; ++i) motion[i] = prior_[i] * normal(random);
      found.push_back(solve(motion));
    }
    std::stable_sort(found.begin(), found.end(),
                     [](const Solution& a, const Solution& b) { return a.mass < b.mass; });
    return found;
  }

  const std::vector<Touch>& touches() const { return touches_; }  ///< with the sigmas that count
  /// Returns the information of the touches that the gate lets in.
  Matrix6 information(const Vector6& motion) const {
    Matrix6 sum = Matrix6::Zero();
    for (const Touch& touch : touches_) {
      const Gap found = gap(touch, motion);
      if (std::abs(found.in_sigmas) <= options_.gate_sigmas) sum += found.slope * found.slope.transpose();
    }
    return sum;
  }
  Matrix6 posterior(Matrix6 information) const {
    information += prior_.cwiseAbs2().cwiseInverse().asDiagonal();
    return information;
  }

 private:
  Gap gap_to(const TouchSurface::Place& place, double radius_m, double sigma_m, const Vector6& motion) const {
    const geometry::Pose X_WO = moved(motion);
    const Eigen::Vector3d n_W = X_WO.rotation * place.normal_O;
    const Eigen::Vector3d lever_m = X_WO * place.point_O_m - middle_W_m(motion);
    Gap gap;
    gap.gap_m = place.distance_m - radius_m;
    gap.in_sigmas = gap.gap_m / sigma_m;
    gap.slope << -lever_m.cross(n_W), -n_W;
    gap.slope /= sigma_m;
    return gap;
  }

  const TouchSurface& surface_;
  const geometry::Pose& model_WO_;
  std::vector<Touch> touches_;
  const std::vector<FreePlace>& free_;
  const TouchOptions& options_;
  Vector6 prior_;
  Eigen::Vector3d middle_W_m_;
  double least_sigma_m_ = 0.01;
};

core::Status check(const std::vector<Touch>& touches, const std::vector<FreePlace>& free) {
  if (touches.empty() && free.empty())
    return core::Status::invalid_argument("nothing was touched; allowed: a touch or more");
  const auto good = [](const auto& t) {
    return t.p_W_m.allFinite() && std::isfinite(t.radius_m) && t.radius_m >= 0 && std::isfinite(t.sigma_m) &&
           t.sigma_m > 0;
  };
  for (std::size_t i = 0; i < touches.size(); ++i) {
    const auto& normal = touches[i].normal_W;
    if (!good(touches[i]) || (normal && !(std::abs(normal->norm() - 1.0) < 1e-6)))
      return core::Status::invalid_argument(formatted(
          "touch %zu: allowed: finite numbers, a radius from 0, a sigma above 0, a normal of length 1",
          i + 1));
  }
  if (!std::all_of(free.begin(), free.end(), good))
    return core::Status::invalid_argument(
        "a place without a touch: allowed: finite numbers, a radius from 0, a sigma above 0");
  return {};
}

double apart_m(const TouchSurface& surface, const geometry::Pose& a, const geometry::Pose& b) {
  double worst_m = 0.0;
  for (const Eigen::Vector3d& p : surface.extremes_O_m()) worst_m = std::max(worst_m, (a * p - b * p).norm());
  return worst_m;
}

std::string numbers_of(const std::vector<std::size_t>& touches) {
  return core::listed(touches, [](std::size_t i) { return std::to_string(i + 1); });
}

std::string refusal_of(const TouchCorrection& c, std::size_t touches, const TouchOptions& options) {
  if (c.unexplained.size() == touches && touches > 0)
    return "no pose near the model explains the touches: something else was touched, or the object is farther "
           "off than the prior allows";
  if (!c.unexplained.empty() && 3 * c.unexplained.size() > touches)
    return "touches " + numbers_of(c.unexplained) + " are explained by no pose that explains the others";
  if (c.rival_WO) {
    const Eigen::Vector3d between_mm = 1e3 * (c.rival_WO->translation_m - c.fit.X_WO.translation_m);
    return formatted(
        "another pose explains the touches as well, (%.1f %.1f %.1f) mm from this one; allowed: one. A touch "
        "of a face that looks that way decides",
        between_mm.x(), between_mm.y(), between_mm.z());
  }
  if (c.fit.degrees > 0 && c.fit.probability() < options.least_fit_probability)
    return formatted("the touches contradict one another (probability %.1g; allowed: at least %.1g)",
                     c.fit.probability(), options.least_fit_probability);
  if (c.determined.empty()) return "the touches determine nothing yet";
  return "";
}

}  // namespace

core::Expected<TouchCorrection> correct_by_touch(const TouchSurface& surface, const geometry::Pose& model_WO,
                                                 const std::vector<Touch>& touches,
                                                 const std::vector<FreePlace>& free,
                                                 const TouchOptions& options) {
  if (surface.empty()) return core::Status::invalid_argument("the object has no surface");
  if (const core::Status status = check(touches, free); !status) return status;
  const TouchProblem problem(surface, model_WO, touches, free, options);
  const auto found = problem.solve_all();
  const Vector6& motion = found.front().motion;
  TouchCorrection c;
  c.model_WO = model_WO;
  c.fit.X_WO = found.front().X_WO;
  c.fit.X_WO.rotation = geometry::rotation_from_quaternion(geometry::quaternion_xyzw(c.fit.X_WO.rotation));
  c.fit.centre_W_m = problem.middle_W_m(motion);
  double before = 0.0, known = 0.0;
  for (std::size_t i = 0; i < touches.size(); ++i) {
    const Touch& touch = problem.touches()[i];
    const Gap was = problem.gap(touch, Vector6::Zero()), is = problem.gap(touch, motion);
    c.before_m.push_back(was.gap_m);
    c.after_m.push_back(is.gap_m);
    before += was.in_sigmas * was.in_sigmas;
    if (std::abs(is.in_sigmas) > options.gate_sigmas) {
      c.unexplained.push_back(i);
    } else {
      c.fit.chi2 += is.in_sigmas * is.in_sigmas;
    }
  }
  c.contradicts =
      !touches.empty() && chi_square_tail(before, static_cast<int>(touches.size())) < 1 - options.confidence;
  for (const FreePlace& place : free)
    c.contradicts = c.contradicts || problem.gap(place, Vector6::Zero()).in_sigmas < -options.gate_sigmas;
  const Matrix6 information = problem.information(motion);
  c.fit.covariance = geometry::inverse_symmetric(problem.posterior(information));
  known = (c.fit.covariance * information).trace();  // the effective number of directions that touches fix
  c.fit.degrees =
      static_cast<int>(touches.size() - c.unexplained.size()) - static_cast<int>(std::lround(known));
  std::vector<Eigen::Vector3d> extremes_W_m;
  for (const Eigen::Vector3d& p : surface.extremes_O_m()) extremes_W_m.push_back(c.fit.X_WO * p);
  split_directions(information, c.fit.centre_W_m, extremes_W_m, options, c.determined, c.open);
  PartModel extent;
  extent.extremes_O_m = surface.extremes_O_m();
  c.worst_after_m = worst_displacement_m(extent, c.fit, options.confidence);
  c.moved_m = apart_m(surface, model_WO, c.fit.X_WO);
  c.turned_rad = geometry::rotation_vector(c.fit.X_WO.rotation * model_WO.rotation.transpose()).norm();
  c.worst_before_m = c.moved_m + c.worst_after_m;
  const double likely = -2.0 * std::log(1.0 - options.confidence);
  for (const auto& other : found) {
    if (other.mass - found.front().mass > likely) break;
    Vector6 between;
    between << geometry::rotation_vector(other.X_WO.rotation * c.fit.X_WO.rotation.transpose()),
        problem.middle_W_m(other.motion) - c.fit.centre_W_m;
    if (displacement_in_m(c.determined, between, c.fit.centre_W_m, extremes_W_m, options) <=
        options.determined_m)
      continue;
    c.rival_WO = other.X_WO;
    break;
  }
  c.refusal = refusal_of(c, touches.size(), options);
  return c;
}

}  // namespace phantom::survey

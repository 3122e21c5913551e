#include "common/survey/range_head.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/core/text.hpp"
#include "common/core/units.hpp"

namespace phantom::survey {
namespace {

using std::numbers::pi;

std::string number(double value) { return core::formatted("%g", value); }

double draw(ErrorLaw law, double bound, std::mt19937_64& random) {
  switch (law) {
    case ErrorLaw::kUniform:
      return bound * std::uniform_real_distribution<double>(-1.0, 1.0)(random);
    case ErrorLaw::kNormal:
      return sigma_of(law, bound) * std::normal_distribution<double>()(random);
    case ErrorLaw::kExtreme:
      return std::bernoulli_distribution()(random) ? bound : -bound;
  }
  return 0.0;
}

}  // namespace

double sigma_of(ErrorLaw law, double bound) {
  return law == ErrorLaw::kUniform  ? bound / std::numbers::sqrt3
         : law == ErrorLaw::kNormal ? 0.5 * bound
                                    : bound;
}

double range_bound_m(const HeadErrors& errors, const Reading& reading) {
  return errors.range_m + errors.range_per_m * reading.range_m;
}

core::Status check_reading(const RangeHead& head, const Reading& reading) {
  if (!(reading.range_m >= head.min_range_m && reading.range_m <= head.max_range_m)) {
    return core::Status::invalid_argument("range " + number(reading.range_m) +
                                          " m; allowed: " + number(head.min_range_m) + " to " +
                                          number(head.max_range_m) + " m");
  }
  if (!(std::abs(reading.pan_rad) <= 2 * pi))
    return core::Status::invalid_argument("pan " + number(reading.pan_rad / core::kRadPerDegree) +
                                          " deg; allowed: -360 to 360 deg");
  if (!(reading.tilt_rad >= 0 && reading.tilt_rad <= pi))
    return core::Status::invalid_argument("tilt " + number(reading.tilt_rad / core::kRadPerDegree) +
                                          " deg; allowed: 0 to 180 deg");
  return {};
}

Eigen::Vector3d spot_W_m(const RangeHead& head, const Reading& reading) {
  const double r = head.beam_offset_m, L = std::hypot(reading.range_m, r);
  const double phi = pi - reading.tilt_rad - std::acos(r / L), theta = reading.pan_rad;
  return head.X_WH * Eigen::Vector3d(L * std::cos(phi) * std::cos(theta), L * std::cos(phi) * std::sin(theta),
                                     -L * std::sin(phi));
}

Eigen::Matrix3d spot_jacobian(const RangeHead& head, const Reading& reading) {
  const double r = head.beam_offset_m, L = std::hypot(reading.range_m, r);
  const double phi = pi - reading.tilt_rad - std::acos(r / L), theta = reading.pan_rad;
  const double cp = std::cos(phi), sp = std::sin(phi), ct = std::cos(theta), st = std::sin(theta);
  const Eigen::Vector3d by_L(cp * ct, cp * st, -sp), by_phi = L * Eigen::Vector3d(-sp * ct, -sp * st, -cp),
                                                     by_theta = L * Eigen::Vector3d(-cp * st, cp * ct, 0.0);
  Eigen::Matrix3d J;
  J.col(0) = by_L * (reading.range_m / L) - by_phi * (r / (L * L));
  J.col(1) = by_theta;
  J.col(2) = -by_phi;
  return head.X_WH.rotation * J;
}

Eigen::Vector3d beam_direction_W(const RangeHead& head, const Reading& reading) {
  return spot_jacobian(head, reading).col(0).normalized();
}

Eigen::Matrix3d spot_covariance_m2(const RangeHead& head, const HeadErrors& errors, const Reading& reading) {
  const Eigen::Vector3d sigma(sigma_of(errors.law, range_bound_m(errors, reading)),
                              sigma_of(errors.law, errors.pan_rad), sigma_of(errors.law, errors.tilt_rad));
  const Eigen::Matrix3d scaled = spot_jacobian(head, reading) * sigma.asDiagonal();
  const Eigen::Vector3d beam = beam_direction_W(head, reading);
  const double targeting_m = sigma_of(errors.law, errors.targeting_m);
  return scaled * scaled.transpose() +
         targeting_m * targeting_m * (Eigen::Matrix3d::Identity() - beam * beam.transpose());
}

core::Expected<Reading> aim(const RangeHead& head, const Eigen::Vector3d& p_W_m) {
  const Eigen::Vector3d p = head.X_WH.inverse() * p_W_m;
  const double L = p.norm(), r = head.beam_offset_m;
  if (!(L > std::abs(r) && std::isfinite(L))) {
    return core::Status::invalid_argument("the point is " + number(L) +
                                          " m from the head's rotation centre; allowed: more than its " +
                                          number(r) + " m offset");
  }
  Reading reading;
  reading.range_m = std::sqrt(L * L - r * r);
  reading.pan_rad = std::atan2(p.y(), p.x());
  reading.tilt_rad = pi - std::asin(std::clamp(-p.z() / L, -1.0, 1.0)) - std::acos(r / L);
  if (auto checked = check_reading(head, reading); !checked) return checked;
  return reading;
}

core::Expected<Reading> simulate_reading(const RangeHead& head, const HeadErrors& errors,
                                         const Eigen::Vector3d& p_W_m, std::mt19937_64& random) {
  const auto meant = aim(head, p_W_m);
  if (!meant) return meant;
  const Eigen::Vector3d beam = beam_direction_W(head, *meant);
  const Eigen::Vector3d across = beam.unitOrthogonal(), along = beam.cross(across);
  const double a_m = draw(errors.law, errors.targeting_m, random),
               b_m = draw(errors.law, errors.targeting_m, random);
  auto read = aim(head, p_W_m + a_m * across + b_m * along);
  if (!read) return read;
  read->range_m += draw(errors.law, range_bound_m(errors, *meant), random);
  read->pan_rad += draw(errors.law, errors.pan_rad, random);
  read->tilt_rad += draw(errors.law, errors.tilt_rad, random);
  if (auto checked = check_reading(head, *read); !checked) return checked;
  return read;
}

}  // namespace phantom::survey

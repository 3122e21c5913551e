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

}  // namespace

double draw_error(ErrorLaw law, double bound, std::mt19937_64& random) {
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

double sigma_of(ErrorLaw law, double bound) {
  return law == ErrorLaw::kUniform  ? bound / std::numbers::sqrt3
         : law == ErrorLaw::kNormal ? 0.5 * bound
                                    : bound;
}

double range_bound_m(const HeadErrors& errors, const Reading& reading) {
  return errors.range_m + errors.range_per_m * reading.range_m;
}

double spot_radius_m(const HeadErrors& errors, double range_m) {
  return errors.spot_m + errors.spot_per_m * range_m;
}

double targeting_bound_m(const HeadErrors& errors, double range_m) {
  return std::hypot(errors.targeting_m, spot_radius_m(errors, range_m) / sigma_of(errors.law, 1.0));
}

Eigen::Vector3d displacement_on_face_m(const Eigen::Vector3d& across_m, const Eigen::Vector3d& beam,
                                       const Eigen::Vector3d& normal) {
  const double cosine = normal.dot(beam);
  const Eigen::Vector3d tilted = normal - cosine * beam;  // of length sine
  const double sine = tilted.norm();
  if (sine == 0.0) return across_m;
  const double tangent = std::min(sine / std::abs(cosine), std::tan(kMaxIncidence_rad));
  const double along_m = -tangent * across_m.dot(tilted) / sine;
  return across_m + (cosine < 0.0 ? -along_m : along_m) * beam;
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

Eigen::Matrix3d spot_covariance_m2(const RangeHead& head, const HeadErrors& errors, const Reading& reading,
                                   const std::optional<Eigen::Vector3d>& normal_W) {
  const Eigen::Vector3d sigma(sigma_of(errors.law, range_bound_m(errors, reading)),
                              sigma_of(errors.law, errors.pan_rad), sigma_of(errors.law, errors.tilt_rad));
  const Eigen::Matrix3d scaled = spot_jacobian(head, reading) * sigma.asDiagonal();
  const Eigen::Vector3d beam = beam_direction_W(head, reading);
  const double targeting_m = sigma_of(errors.law, targeting_bound_m(errors, reading.range_m));
  const Eigen::Vector3d across = beam.unitOrthogonal();
  Eigen::Matrix<double, 3, 2> moved;
  moved << across, beam.cross(across);
  if (normal_W)
    for (int i = 0; i < 2; ++i) moved.col(i) = displacement_on_face_m(moved.col(i), beam, *normal_W);
  return scaled * scaled.transpose() + targeting_m * targeting_m * moved * moved.transpose();
}

Eigen::Matrix3d spot_covariance_unknown_face_m2(const RangeHead& head, const HeadErrors& errors,
                                                const Reading& reading) {
  const Eigen::Vector3d beam = beam_direction_W(head, reading);
  const double along_m =
      std::tan(kUnknownIncidence_rad) * sigma_of(errors.law, targeting_bound_m(errors, reading.range_m));
  return spot_covariance_m2(head, errors, reading) + along_m * along_m * beam * beam.transpose();
}

Eigen::Matrix<double, 6, 6> mounting_covariance(const HeadErrors& errors) {
  const double turn_rad = sigma_of(errors.law, errors.mounting_rad),
               shift_m = sigma_of(errors.law, errors.mounting_m);
  Eigen::Matrix<double, 6, 1> variances;
  variances << Eigen::Vector3d::Constant(turn_rad * turn_rad), Eigen::Vector3d::Constant(shift_m * shift_m);
  return variances.asDiagonal();
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
                                         const Eigen::Vector3d& p_W_m, std::mt19937_64& random,
                                         const std::optional<Eigen::Vector3d>& normal_W) {
  const auto meant = aim(head, p_W_m);
  if (!meant) return meant;
  const Eigen::Vector3d beam = beam_direction_W(head, *meant);
  const Eigen::Vector3d across = beam.unitOrthogonal(), along = beam.cross(across);
  const double bound_m = targeting_bound_m(errors, meant->range_m);
  const double a_m = draw_error(errors.law, bound_m, random), b_m = draw_error(errors.law, bound_m, random);
  const Eigen::Vector3d off_m = a_m * across + b_m * along;
  auto read = aim(head, p_W_m + (normal_W ? displacement_on_face_m(off_m, beam, *normal_W) : off_m));
  if (!read) return read;
  read->range_m += draw_error(errors.law, range_bound_m(errors, *meant), random);
  read->pan_rad += draw_error(errors.law, errors.pan_rad, random);
  read->tilt_rad += draw_error(errors.law, errors.tilt_rad, random);
  if (auto checked = check_reading(head, *read); !checked) return checked;
  return read;
}

RangeHead simulate_mounting(const RangeHead& head, const HeadErrors& errors, std::mt19937_64& random) {
  Eigen::Vector3d turn_rad, shift_m;
  for (double& component : turn_rad) component = draw_error(errors.law, errors.mounting_rad, random);
  for (double& component : shift_m) component = draw_error(errors.law, errors.mounting_m, random);
  RangeHead mounted = head;
  mounted.X_WH.rotation = geometry::rotation_from_vector(turn_rad) * head.X_WH.rotation;
  mounted.X_WH.translation_m += shift_m;
  return mounted;
}

}  // namespace phantom::survey

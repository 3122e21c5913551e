#pragma once

#include <Eigen/Core>
#include <random>
#include <string>

#include "common/core/status.hpp"
#include "common/geometry/pose.hpp"

namespace phantom::survey {

/// A laser ranger on a pan–tilt platform (thesis A.2). Frame H: origin in the rotation centre, z along the
/// pan axis upwards, x where pan is 0. The ranger sits at `beam_offset_m` from the rotation centre, its beam
/// at right angles to that arm.
struct RangeHead {
  geometry::Pose X_WH;
  double beam_offset_m = 0.0;  ///< r of eqs. A.7 and A.8
  double min_range_m = 0.05;   ///< what the ranger can measure
  double max_range_m = 30.0;
};

/// How the true value lies about the one that was read, for a bound b of the instrument's data sheet.
enum class ErrorLaw {
  kUniform,  ///< anywhere within ±b: σ = b/√3
  kNormal,   ///< b is two standard deviations
  kExtreme,  ///< at +b or −b: the worst that the data sheet allows (thesis fig. A.13 and A.16)
};

/// What the instrument's data sheet and the person who aims leave open: bounds, one for each reading.
struct HeadErrors {
  double range_m = 0.0025;      ///< δr (thesis: ±2.5 mm)
  double range_per_m = 0.0;     ///< and more of it per metre of range (A.4.1: δr grows with r)
  double pan_rad = 0.00035;     ///< δθ
  double tilt_rad = 0.00035;    ///< δφ
  double targeting_m = 0.0005;  ///< the spot beside the corner that is meant, across the beam (A.4.2)
  ErrorLaw law = ErrorLaw::kUniform;
};

/// One targeting, as the head tells it.
struct Reading {
  double range_m = 0.0;   ///< L′, from the ranger
  double pan_rad = 0.0;   ///< θ, about the pan axis from x
  double tilt_rad = 0.0;  ///< ψ, of the ranger's arm; π/2: the beam is horizontal, less: it looks down
  friend bool operator==(const Reading&, const Reading&) = default;
};

/// Standard deviation of an error with bound `bound` under a law.
double sigma_of(ErrorLaw law, double bound);

/// The bound of the range's error at a reading.
double range_bound_m(const HeadErrors& errors, const Reading& reading);

/// Whether a reading is one: finite, within the ranger's range, tilt within 0…π. The message says which is
/// not and what is allowed.
core::Status check_reading(const RangeHead& head, const Reading& reading);

/// The spot's place in W: L = √(L′² + r²), φ = π − ψ − acos(r/L) (A.7, A.8), P_H = L·(cosφ cosθ, cosφ sinθ,
/// −sinφ) with φ below the horizontal (A.2, with the errata of spec 1: consistent spherical coordinates).
/// Real-time safe: yes.
Eigen::Vector3d spot_W_m(const RangeHead& head, const Reading& reading);

/// ∂spot_W/∂(range, pan, tilt), columns in this order. Real-time safe: yes.
Eigen::Matrix3d spot_jacobian(const RangeHead& head, const Reading& reading);

/// Unit vector in W along the beam, away from the head. Real-time safe: yes.
Eigen::Vector3d beam_direction_W(const RangeHead& head, const Reading& reading);

/// Covariance of the spot about the corner that was meant, W, m²: the readings' errors through the Jacobian,
/// and the targeting across the beam.
Eigen::Matrix3d spot_covariance_m2(const RangeHead& head, const HeadErrors& errors, const Reading& reading);

/// The reading that puts the spot on a point: the inverse of spot_W_m(). Refuses points that the beam cannot
/// reach: nearer than the offset, or out of the ranger's range.
core::Expected<Reading> aim(const RangeHead& head, const Eigen::Vector3d& p_W_m);

/// A simulated targeting of a point with errors drawn by the law. Deterministic for a generator's state.
core::Expected<Reading> simulate_reading(const RangeHead& head, const HeadErrors& errors,
                                         const Eigen::Vector3d& p_W_m, std::mt19937_64& random);

}  // namespace phantom::survey

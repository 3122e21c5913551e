#pragma once

#include <Eigen/Core>
#include <optional>
#include <random>
#include <string>

#include "common/core/status.hpp"
#include "common/geometry/pose.hpp"

namespace phantom::survey {

/// A laser ranger on a pan–tilt platform (thesis A.2). Frame H has its origin in the rotation centre, z
/// upwards along the pan axis and x where pan is 0. The ranger is `beam_offset_m` from the rotation centre;
/// its beam is perpendicular to that arm.
struct RangeHead {
  geometry::Pose X_WH;
  double beam_offset_m = 0.0;  ///< r of eqs. A.7 and A.8
  double min_range_m = 0.05;   ///< limits of the ranger
  double max_range_m = 30.0;
};

/// Distribution of the true value about the reading, for a bound b from the instrument's data sheet.
enum class ErrorLaw {
  kUniform,  ///< uniform within ±b: σ = b/√3
  kNormal,   ///< b is two standard deviations
  kExtreme,  ///< at +b or −b: the worst case of the data sheet (thesis fig. A.13 and A.16)
};

/// Error bounds from the instrument's data sheet, for the person who aims, and for the head's mounting.
struct HeadErrors {
  double range_m = 0.0025;      ///< δr (thesis: ±2.5 mm)
  double range_per_m = 0.0;     ///< additional error per metre of range (A.4.1: δr grows with r)
  double pan_rad = 0.00035;     ///< δθ
  double tilt_rad = 0.00035;    ///< δφ
  double targeting_m = 0.0005;  ///< distance of the spot from the intended corner, across the beam (A.4.2)
  double spot_m = 0.0;          ///< radius of the spot at the head: the corner is somewhere under the spot
  double spot_per_m = 0.0;      ///< growth of that radius per metre of range
  /// The errors of RangeHead::X_WH, the same in all readings: of the rotation centre along each axis of W,
  /// and of the turn about each.
  double mounting_m = 0.0, mounting_rad = 0.0;
  ErrorLaw law = ErrorLaw::kUniform;
};

/// One targeting, as the head reports it.
struct Reading {
  double range_m = 0.0;   ///< L′, from the ranger
  double pan_rad = 0.0;   ///< θ, about the pan axis from x
  double tilt_rad = 0.0;  ///< ψ, of the ranger's arm; π/2: horizontal beam, less: it points down
  friend bool operator==(const Reading&, const Reading&) = default;
};

/// Returns the standard deviation of an error with bound `bound` under a law.
double sigma_of(ErrorLaw law, double bound);

/// Returns an error with bound `bound`, drawn by a law. Deterministic for a given state of the generator.
double draw_error(ErrorLaw law, double bound, std::mt19937_64& random);

/// Returns the bound of the range error at a reading.
double range_bound_m(const HeadErrors& errors, const Reading& reading);

/// Returns the radius of the spot at a range, across the beam.
double spot_radius_m(const HeadErrors& errors, double range_m);

/// Returns the bound of the distance between the spot's middle and the intended corner, across the beam: of
/// aiming and of the spot's size. The spot's radius counts as a standard deviation whatever the law: a spot
/// that is wholly on the face has its middle a radius off each edge.
double targeting_bound_m(const HeadErrors& errors, double range_m);

/// Greatest incidence (angle between beam and normal) that is distinguished from a larger one: nearer to 90
/// degrees, a spot is no spot any more.
inline constexpr double kMaxIncidence_rad = 1.4;
/// Incidence on a face of which too little is measured to know its normal.
inline constexpr double kUnknownIncidence_rad = 1.0472;

/// Returns how far a displacement across the beam, in the plane of the face that is hit, carries the spot: it
/// stays on the face, so that the range changes with the tangent of the incidence (at most
/// kMaxIncidence_rad). `across_m`: perpendicular to the unit vector `beam`; `normal`: of the face, unit, of
/// either sign. All in one frame. Real-time safe: yes.
Eigen::Vector3d displacement_on_face_m(const Eigen::Vector3d& across_m, const Eigen::Vector3d& beam,
                                       const Eigen::Vector3d& normal);

/// Checks whether a reading is valid: finite, within the ranger's limits, tilt within 0…π. The message says
/// which value is not, and what is allowed.
core::Status check_reading(const RangeHead& head, const Reading& reading);

/// Returns the spot's position in W: L = √(L′² + r²), φ = π − ψ − acos(r/L) (A.7, A.8), P_H = L·(cosφ cosθ,
/// cosφ sinθ, −sinφ) with φ below the horizontal (A.2, with the errata of spec 1: consistent spherical
/// coordinates). Real-time safe: yes.
Eigen::Vector3d spot_W_m(const RangeHead& head, const Reading& reading);

/// Returns ∂spot_W/∂(range, pan, tilt), with columns in this order. Real-time safe: yes.
Eigen::Matrix3d spot_jacobian(const RangeHead& head, const Reading& reading);

/// Returns the unit vector in W along the beam, away from the head. Real-time safe: yes.
Eigen::Vector3d beam_direction_W(const RangeHead& head, const Reading& reading);

/// Returns the covariance of the spot about the intended corner, W, m²: the readings' errors through the
/// Jacobian, and the errors of targeting along the face with unit normal `normal_W`, or across the beam if
/// there is none. The mounting's error is not in it, since it is common to all spots.
Eigen::Matrix3d spot_covariance_m2(const RangeHead& head, const HeadErrors& errors, const Reading& reading,
                                   const std::optional<Eigen::Vector3d>& normal_W = {});

/// Returns the same for a face with unknown normal: at kUnknownIncidence_rad, in any direction.
Eigen::Matrix3d spot_covariance_unknown_face_m2(const RangeHead& head, const HeadErrors& errors,
                                                const Reading& reading);

/// Returns the covariance of the error of X_WH: turn about the rotation centre and its shift (rad, m; W
/// axes).
Eigen::Matrix<double, 6, 6> mounting_covariance(const HeadErrors& errors);

/// Returns the reading that puts the spot on a point: the inverse of spot_W_m(). Refuses points that the beam
/// cannot reach: nearer than the offset, or beyond the ranger's limits.
core::Expected<Reading> aim(const RangeHead& head, const Eigen::Vector3d& p_W_m);

/// Simulates targeting a point of a face with unit normal `normal_W` (none: of one that faces the beam), with
/// errors drawn by the law, all but the mounting's. Deterministic for a given state of the generator.
core::Expected<Reading> simulate_reading(const RangeHead& head, const HeadErrors& errors,
                                         const Eigen::Vector3d& p_W_m, std::mt19937_64& random,
                                         const std::optional<Eigen::Vector3d>& normal_W = {});

/// Returns the head as it is really mounted, with an error of the mounting drawn by the law.
RangeHead simulate_mounting(const RangeHead& head, const HeadErrors& errors, std::mt19937_64& random);

}  // namespace phantom::survey

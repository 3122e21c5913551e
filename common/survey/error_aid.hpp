#pragma once

#include <vector>

#include "common/survey/measurement.hpp"

namespace phantom::survey {

/// What the error aid (A.5) finds about one corner of a face.
struct NodeCheck {
  std::size_t node = 0;  ///< index into Measurement::nodes
  /// Angle between the normal of its two edges and the face's normal; 0 at the ends of an open face.
  double normal_departs_rad = 0;
  /// How much its range is too long (+) or too short (−) for the plane of the good corners.
  double off_plane_m = 0.0;
  double sigma_m = 0.0;  ///< standard deviation of off_plane_m, including that of the plane
  bool suspect = false;
};

/// The check of a measured face. If its corners lie on one plane within their errors, none is suspect.
/// Otherwise the suspects are the smallest set of corners without which the others lie on a plane.
struct FaceCheck {
  std::vector<NodeCheck> nodes;                      ///< in the face's order
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< of the good corners' plane, towards the eye
  double plane_probability = 1.0;  ///< probability that errors alone move the corners so far from one plane
  /// Other sets of equally few corners, by index in the face, that explain the departure as well: with one
  /// corner more than a plane needs, it is impossible to say which is wrong. Empty: the set is unique, or
  /// nothing is suspect.
  std::vector<std::vector<std::size_t>> alternatives;
  bool redundant = false;  ///< false: three corners always lie on a plane, so nothing can be checked
};

/// Below this probability, a departure does not count as the instrument's usual error.
inline constexpr double kSuspicion = 0.03;

/// Checks a measured face of three corners or more. Pure.
FaceCheck check_face(const Measurement& measurement, const MeasuredFace& face);

/// Returns advice as text: which corners to measure again and why. Empty if there is none.
std::vector<std::string> advice(const Measurement& measurement, const MeasuredFace& face,
                                const FaceCheck& check);

/// The plane that best fits measured points, by least squares of their distances in units of their own
/// errors.
struct Plane {
  Eigen::Vector3d point_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< unit, towards the eye
  /// Covariance of (height in point_m, slope along axis_u, slope along axis_v).
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  Eigen::Vector3d axis_u = Eigen::Vector3d::UnitX(), axis_v = Eigen::Vector3d::UnitY();
  double chi2 = 0.0;
  int degrees = 0;  ///< degrees of freedom: corners less three
};
/// Fits a plane to nodes given by index; there must be at least three, not in line.
Plane fit_plane(const Measurement& measurement, const std::vector<std::size_t>& nodes);

/// How far a node that a plane was not fitted to lies off it.
struct Departure {
  double off_m = 0.0;    ///< along the plane's normal
  double sigma_m = 0.0;  ///< standard deviation, of the node and the plane
};
Departure departure_from(const Plane& plane, const MeasuredNode& node);

}  // namespace phantom::survey

#pragma once

#include <vector>

#include "common/survey/measurement.hpp"

namespace phantom::survey {

/// What the error aid (A.5) says of one corner of a face.
struct NodeCheck {
  std::size_t node = 0;  ///< index into Measurement::nodes
  double normal_departs_rad =
      0;  ///< of the normal of its two edges from the face's; 0 at the ends of an open face
  double off_plane_m =
      0.0;  ///< how much its range is too long (+) or too short (−) for the plane of the good ones
  double sigma_m = 0.0;  ///< standard deviation of that, the plane's own included
  bool suspect = false;
};

/// A face looked over. If its corners lie on one plane within their errors, none is suspect. Else the
/// suspects are the fewest corners without which the others do.
struct FaceCheck {
  std::vector<NodeCheck> nodes;                      ///< in the face's order
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< of the plane through the good ones, towards the eye
  double plane_probability = 1.0;  ///< that all corners depart so far from one plane by their errors alone
  /// Other sets of as few corners (by their place in the face) that explain it as well: with one corner more
  /// than a plane needs, nobody can tell which it is. Empty: it is clear, or nothing is suspect.
  std::vector<std::vector<std::size_t>> alternatives;
  bool redundant = false;  ///< false: three corners always lie on a plane, nothing can be said
};

/// Below this probability a departure is not taken for the instrument's usual error.
inline constexpr double kSuspicion = 0.03;

/// Looks a measured face of three corners or more over. Pure.
FaceCheck check_face(const Measurement& measurement, const MeasuredFace& face);

/// Advice in words: which corners to measure again and why; empty if there is nothing to say.
std::vector<std::string> advice(const Measurement& measurement, const MeasuredFace& face,
                                const FaceCheck& check);

/// The plane that lies best between measured places: least squares of their distances, each in units of its
/// own error.
struct Plane {
  Eigen::Vector3d point_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< unit, towards the eye
  /// Covariance of (height in point_m, slope along axis_u, slope along axis_v).
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  Eigen::Vector3d axis_u = Eigen::Vector3d::UnitX(), axis_v = Eigen::Vector3d::UnitY();
  double chi2 = 0.0;
  int degrees = 0;  ///< corners less three
};
/// `nodes`: three indices at least, not in line.
Plane fit_plane(const Measurement& measurement, const std::vector<std::size_t>& nodes);

}  // namespace phantom::survey

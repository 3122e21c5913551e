#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "common/core/status.hpp"
#include "common/survey/range_head.hpp"

namespace phantom::survey {

/// A corner of an object, registered: where it was measured, and how well.
struct MeasuredNode {
  std::string name;
  Eigen::Vector3d p_W_m = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance_m2 = Eigen::Matrix3d::Identity();
  Eigen::Vector3d beam_W = Eigen::Vector3d::UnitX();  ///< unit vector from the head to the node
  int times = 1;                                      ///< how often it was targeted
};

/// What was measured of one plane face: its corners in the order in which they follow one another on the
/// face's border, either way round.
struct MeasuredFace {
  std::string name;
  bool closed =
      true;  ///< all corners of the face's border; false: some that follow one another (an edge, a corner …)
  std::vector<std::size_t> nodes;  ///< indices into Measurement::nodes
};

/// All that was measured of one object.
struct Measurement {
  std::vector<MeasuredNode> nodes;
  std::vector<MeasuredFace> faces;
  Eigen::Vector3d eye_W_m =
      Eigen::Vector3d::Zero();  ///< the head's rotation centre: what is measured faces it
};

/// A targeting of one corner of one face, as a person or a file gives it.
struct Targeting {
  std::string face;
  bool closed = true;              ///< see MeasuredFace
  std::string node;                ///< the same name again is the same corner: the readings are averaged
  std::optional<Reading> reading;  ///< none: the corner was targeted before, and lies on this face, too
  std::string place;               ///< where it stands ("points.csv:7"), for messages
};

/// Registers targetings: places with covariances, corners that were targeted several times put together
/// (weighted by their covariances; a reading that is the last one's copy to the last bit is no other
/// measurement). Refuses, naming place and node: readings that are none, a node whose readings contradict one
/// another, a corner without any, a face that is closed in one row and not in another.
core::Expected<Measurement> register_nodes(const RangeHead& head, const HeadErrors& errors,
                                           const std::vector<Targeting>& targetings);

/// Whether the nodes can be what they are said to be: no two on one spot, no face of corners in line, a
/// closed face of three corners at least. Errors are those of the covariances. The message names face and
/// nodes.
core::Status check_measurement(const Measurement& measurement);

/// A border polygon's metrics (A.3–A.6). Edge i runs from corner i to corner i+1; an open polygon of n
/// corners has n − 1 edges. Angles are those between the two edges at a corner, 0…π, and the turn from one
/// edge to the next about the normal, −π…π (left turns are positive seen against the normal); both 0 at the
/// ends of an open polygon.
struct FaceMetrics {
  std::vector<double> edge_m, angle_rad, turn_rad;
  Eigen::Vector3d normal =
      Eigen::Vector3d::Zero();    ///< unit (Newell), towards the eye; zero if there is none
  double area_m2 = 0.0;           ///< of the closed polygon
  bool counter_clockwise = true;  ///< as it is seen from the eye
};
FaceMetrics face_metrics(const std::vector<Eigen::Vector3d>& corners, bool closed,
                         const Eigen::Vector3d& eye_m);

/// The corners of a face.
std::vector<Eigen::Vector3d> corners_of(const Measurement& measurement, const MeasuredFace& face);

/// Three of a face's corners, by their place in the face.
using CornerTriangle = std::array<std::size_t, 3>;

/// The three corners with the greatest triangle: the normal that suffers least from their errors (A.5.1).
/// Needs three corners.
CornerTriangle largest_triangle(const std::vector<Eigen::Vector3d>& corners);

/// Unit normal of a triangle of corners, towards the eye; zero if they are in line.
Eigen::Vector3d triangle_normal(const std::vector<Eigen::Vector3d>& corners, const CornerTriangle& triangle,
                                const Eigen::Vector3d& eye_m);

/// Standard deviation of the distance between two measured places, along their line, m.
double distance_sigma_m(const MeasuredNode& a, const MeasuredNode& b);

/// Probability that a sum of `degrees` squared normal variables is greater than `chi2`. Exact for whole
/// degrees ≥ 1.
double chi_square_tail(double chi2, int degrees);

}  // namespace phantom::survey

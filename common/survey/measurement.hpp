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

/// A registered corner of an object: its measured position and the covariance.
struct MeasuredNode {
  std::string name;
  Eigen::Vector3d p_W_m = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance_m2 = Eigen::Matrix3d::Identity();
  Eigen::Vector3d beam_W = Eigen::Vector3d::UnitX();  ///< unit vector from the head to the node
  int times = 1;                                      ///< how often it was targeted
};

/// What was measured of one plane face: its corners in their order along the face's border, in either
/// direction.
struct MeasuredFace {
  std::string name;
  /// True: the nodes are all corners of the face's border. False: some successive ones (an edge, a corner …).
  bool closed = true;
  std::vector<std::size_t> nodes;  ///< indices into Measurement::nodes
};

/// Everything that was measured of one object.
struct Measurement {
  std::vector<MeasuredNode> nodes;
  std::vector<MeasuredFace> faces;
  Eigen::Vector3d eye_W_m = Eigen::Vector3d::Zero();  ///< the head's rotation centre; measured faces face it
  /// Covariance of the head's mounting, which displaces all nodes together: of a turn about the eye and a
  /// shift (rad, m; W axes). The nodes' covariances do not contain it.
  Eigen::Matrix<double, 6, 6> mounting_covariance = Eigen::Matrix<double, 6, 6>::Zero();
};

/// One targeting of one corner of a face, as a person or a file gives it.
struct Targeting {
  std::string face;
  bool closed = true;              ///< see MeasuredFace
  std::string node;                ///< the same name means the same corner, whose readings are averaged
  std::optional<Reading> reading;  ///< none: the corner was targeted before and lies on this face, too
  std::string place;               ///< source of the targeting for messages, such as "points.csv:7"
};

/// Registers targetings as nodes with positions and covariances. A covariance grows with the beam's incidence
/// on the face in whose row the reading stands; the face's normal is that of its measured corners. Several
/// readings of a corner are averaged, weighted by their covariances; a reading equal to the previous one to
/// the last bit is not counted again. Errors name place and node: invalid readings, a node whose readings
/// contradict each other, a corner without a reading, a face that is closed in one row and not in another.
core::Expected<Measurement> register_nodes(const RangeHead& head, const HeadErrors& errors,
                                           const std::vector<Targeting>& targetings);

/// Checks whether the measurement is consistent: no two nodes at the same spot, no face with all corners in
/// line, at least three corners on a closed face. Takes the errors from the covariances. The message names
/// face and nodes.
core::Status check_measurement(const Measurement& measurement);

/// Metrics of a border polygon (A.3–A.6). Edge i runs from corner i to corner i+1; an open polygon of n
/// corners has n − 1 edges. `angle_rad` is the angle between the two edges at a corner, 0…π. `turn_rad` is
/// the turn from one edge to the next about the normal, −π…π (left turns are positive seen against the
/// normal). Both are 0 at the ends of an open polygon.
struct FaceMetrics {
  std::vector<double> edge_m, angle_rad, turn_rad;
  /// Unit normal by Newell's method, towards the eye; zero if there is none.
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  double area_m2 = 0.0;           ///< of the closed polygon
  bool counter_clockwise = true;  ///< as seen from the eye
};
FaceMetrics face_metrics(const std::vector<Eigen::Vector3d>& corners, bool closed,
                         const Eigen::Vector3d& eye_m);

/// Returns the positions of a face's corners.
std::vector<Eigen::Vector3d> corners_of(const Measurement& measurement, const MeasuredFace& face);

/// Three of a face's corners, by index in the face.
using CornerTriangle = std::array<std::size_t, 3>;

/// Returns the three corners that span the largest triangle, whose normal is least sensitive to their errors
/// (A.5.1). Needs three corners.
CornerTriangle largest_triangle(const std::vector<Eigen::Vector3d>& corners);

/// Returns the unit normal of a triangle of corners, towards the eye; zero if they are in line.
Eigen::Vector3d triangle_normal(const std::vector<Eigen::Vector3d>& corners, const CornerTriangle& triangle,
                                const Eigen::Vector3d& eye_m);

/// Returns the standard deviation, in m, of the distance between two measured nodes, along their line.
double distance_sigma_m(const MeasuredNode& a, const MeasuredNode& b);

/// Returns the probability that a sum of `degrees` squared standard normal variables is greater than `chi2`.
/// Exact for whole degrees ≥ 1.
double chi_square_tail(double chi2, int degrees);

}  // namespace phantom::survey

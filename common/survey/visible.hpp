#pragma once

#include <random>
#include <vector>

#include "common/survey/measurement.hpp"
#include "common/survey/part.hpp"

namespace phantom::survey {

struct VisibleOptions {
  std::size_t most_faces = 2;
  double least_edge_m = 0.02;  ///< faces with shorter edges are not measured
  /// Least cosine between a face's normal and the direction to the head; grazing faces are left out.
  double least_cosine = 0.15;
  std::size_t most_corners = 12;  ///< for each face
};

/// One face of a part as the head sees it: its corners, by index in the part.
struct VisibleFace {
  bool closed = true;  ///< whether the whole border is seen; otherwise the nodes are successive corners
  std::vector<std::uint32_t> nodes;
  std::uint32_t face = 0;  ///< index into PartModel::faces
};

/// Returns what a person at the head would measure of a part at a pose: the faces that look largest from
/// there, with the corners that the part itself does not hide. Deterministic.
std::vector<VisibleFace> visible_faces(const PartModel& part, const geometry::Pose& X_WO,
                                       const Eigen::Vector3d& eye_W_m, const VisibleOptions& options = {});

/// Simulates targetings of those faces' corners. Each corner is targeted once, with errors drawn by their
/// law; if it lies on a second face, the targeting there has no reading of its own. Faces are named "A", "B"
/// …, nodes by consecutive numbers.
core::Expected<std::vector<Targeting>> simulate_targetings(const PartModel& part, const geometry::Pose& X_WO,
                                                           const std::vector<VisibleFace>& faces,
                                                           const RangeHead& head, const HeadErrors& errors,
                                                           std::mt19937_64& random);

}  // namespace phantom::survey

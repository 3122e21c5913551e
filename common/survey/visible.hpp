#pragma once

#include <random>
#include <vector>

#include "common/survey/measurement.hpp"
#include "common/survey/part.hpp"

namespace phantom::survey {

struct VisibleOptions {
  std::size_t most_faces = 2;
  double least_edge_m = 0.02;  ///< faces with shorter edges are not measured
  double least_cosine =
      0.15;  ///< between a face's normal and the way to the head: more grazing ones are left out
  std::size_t most_corners = 12;  ///< per face
};

/// One face of a part as the head sees it: its corners in W, by their numbers in the part.
struct VisibleFace {
  bool closed = true;  ///< all of its border is seen; else some successive corners
  std::vector<std::uint32_t> nodes;
};

/// What a person at the head would measure of a part at a pose: the faces that look largest from there, with
/// the corners that the part itself does not hide. Deterministic.
std::vector<VisibleFace> visible_faces(const PartModel& part, const geometry::Pose& X_WO,
                                       const Eigen::Vector3d& eye_W_m, const VisibleOptions& options = {});

/// Simulated targetings of those faces' corners: each corner is targeted once, with errors by their law;
/// where it is on a second face, the targeting there has no reading of its own. Faces are called "A", "B" …,
/// nodes by their number in order.
core::Expected<std::vector<Targeting>> simulate_targetings(const PartModel& part, const geometry::Pose& X_WO,
                                                           const std::vector<VisibleFace>& faces,
                                                           const RangeHead& head, const HeadErrors& errors,
                                                           std::mt19937_64& random);

}  // namespace phantom::survey

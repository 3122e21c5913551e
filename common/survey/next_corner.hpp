#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "common/survey/fit.hpp"

namespace phantom::survey {

/// A corner to target, where a fitted model has it.
struct PlannedCorner {
  Eigen::Vector3d p_W_m = Eigen::Vector3d::Zero();
  std::optional<std::size_t> measured;  ///< index into Measurement::nodes; none: it was not measured yet
};

/// A face to measure next: its corners in order along the border.
struct PlannedFace {
  bool closed = true;  ///< see MeasuredFace
  std::vector<PlannedCorner> corners;
};

/// Returns the face that adds the most corners to a measurement, of those that the head sees of a part at a
/// pose; of equals, the one that looks largest. None if all that is seen was measured. The places are the
/// model's: they guide a person's aim, and are no measurement. Pure.
std::optional<PlannedFace> plan_next_face(const PartModel& part, const geometry::Pose& X_WO,
                                          const Measurement& measurement, const NodeMap& map);

}  // namespace phantom::survey

#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/survey/measurement.hpp"
#include "common/survey/part.hpp"

namespace phantom::workspace_survey {

/// Where the dialogue stands, for a page beside it. Directions are the head's, as survey::aim() has them.
struct AssistView {
  struct Direction {
    double pan_rad = 0.0, tilt_rad = 0.0;
  };
  struct Node {
    std::string name, face;
    Direction direction;
    double sigma_m = 0.0;  ///< standard deviation of its place, over all directions
  };
  std::string face;                                    ///< that is measured now
  std::size_t corner = 1;                              ///< that comes next on it
  std::vector<Node> nodes;                             ///< all that were measured
  std::optional<Direction> pointing;                   ///< where the head stands; none: it was not aimed
  std::string part;                                    ///< that agrees best; empty: none is placed
  std::vector<std::pair<Direction, Direction>> edges;  ///< of that part, where its best pose has them
  bool fitted = false;                                 ///< a pose is accepted
};

/// Returns what the head sees of a survey: the nodes that were measured, and the edges of a part at a pose
/// (null: none is placed). The dialogue's own state is left as it is by default. Pure.
AssistView survey_view(const survey::RangeHead& head, const survey::HeadErrors& errors,
                       const std::vector<survey::Targeting>& targetings, const survey::PartModel* part,
                       const geometry::Pose& X_WO);

}  // namespace phantom::workspace_survey

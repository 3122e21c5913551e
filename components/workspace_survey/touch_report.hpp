#pragma once

#include <string>
#include <vector>

#include "common/survey/touch.hpp"
#include "common/workspace/grid.hpp"

namespace phantom::workspace_survey {

/// An object that was touched, and what that says, for the reports.
struct TouchFindings {
  std::string object;
  std::vector<survey::Touch> touches;
  std::vector<survey::FreePlace> free;
  survey::TouchCorrection correction;
  double confidence = 0.99;  ///< of its bounds
  workspace::VoxelSize voxel_size_m;
  int least_guard_vox = 0;  ///< that the cell file gives the object
};

/// Returns the guard, in voxels, that covers where the object may be: of the model as it was, and of the
/// corrected one.
int guard_before(const TouchFindings& findings);
int guard_after(const TouchFindings& findings);

/// Returns one line about the newest touch, and what all of them say so far.
std::string touch_line(const TouchFindings& findings);
/// Returns the change that is proposed, with what is determined and what is left open.
std::string change_text(const TouchFindings& findings);
/// Returns all of it as JSON, for programs. `applied`: whether the workspace has the change.
std::string json_text(const TouchFindings& findings, bool applied);

}  // namespace phantom::workspace_survey

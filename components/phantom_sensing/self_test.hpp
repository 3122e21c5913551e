#pragma once

#include <string>

#include "components/phantom_sensing/phantom_sensing.hpp"

namespace phantom::runtime {
struct CellConfig;
}

namespace phantom::phantom_sensing {

struct SelfTestResult {
  bool passed = false;
  std::string message;  ///< what was found, in one sentence: for the log, the status and the reply
};

/// Dips a virtual probe into an object whose layers are known from arithmetic alone: a block with fluid
/// around it, made as every workspace is, and a sliding arm with a row of sensors. Through the same step as
/// the running component, with its settings, it must perceive each layer's μ, the drag that follows, the
/// direction to the block, the motion's class and the rule of a hit, and nothing in free space. Takes
/// milliseconds; not real-time safe.
SelfTestResult test_step(const PerceptSettings& settings);

/// Whether a workspace is what the cell file describes: its grid is the cell's, every voxel of a known object
/// has the μ that the object's profile gives its order, and a virtual probe dipped into each layer of each
/// object perceives that μ and that object through the step. Objects that the cell file does not know (added
/// since) are passed over. Reads every voxel once; not real-time safe.
SelfTestResult test_workspace(const workspace::Workspace& workspace, const runtime::CellConfig& cell,
                              const PerceptSettings& settings);

}  // namespace phantom::phantom_sensing

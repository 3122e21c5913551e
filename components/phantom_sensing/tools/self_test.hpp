#pragma once

#include <string>

#include "components/phantom_sensing/phantom_sensing.hpp"

namespace phantom::runtime {
struct CellConfig;
}

namespace phantom::phantom_sensing {

struct SelfTestResult {
  bool passed = false;
  std::string message;  ///< the result in one sentence: for the log, the status and the reply
};

/// Tests the step on an object whose layers follow from arithmetic: a virtual probe, a sliding arm with a row
/// of sensors, is dipped into the fluid around a block. Workspace and step are made as in the running
/// component, with its settings. The probe must perceive each layer's μ, the resulting drag, the direction to
/// the block, the motion's class and the hit rule, and nothing in free space. Takes milliseconds; not
/// real-time safe.
SelfTestResult test_step(const PerceptSettings& settings);

/// Tests whether a workspace is what the cell file describes: the grid is the cell's; every voxel of a known
/// object has the μ that the object's profile gives its order; and a virtual probe dipped into each layer of
/// each object perceives that μ and that object through the step. Objects that are not in the cell file
/// (added since) are skipped. Reads every voxel once; not real-time safe.
SelfTestResult test_workspace(const workspace::Workspace& workspace, const runtime::CellConfig& cell,
                              const PerceptSettings& settings);

}  // namespace phantom::phantom_sensing

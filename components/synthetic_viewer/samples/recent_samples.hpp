#pragma once

#include <array>

#include "common/runtime/cell/other_arms.hpp"
#include "components/synthetic_viewer/samples/recent_past.hpp"
#include "components/synthetic_viewer/samples/samples.hpp"

namespace phantom::synthetic_viewer {

/// What came over the topics in the last seconds. Any thread.
struct RecentSamples {
  Past<ArmSample> arms;
  std::array<Past<ArmSample>, runtime::kMaxOtherArms>
      others;  ///< other arms, as the configuration lists them
  Past<PerceptSample> percepts;
  Past<GripperSample> grippers;

  /// Returns the arm at a time, between the samples around it; received_ns 0: it is not known for then. A
  /// newest sample that is older by 50 ms at most counts as still true. `silence_ns`: how long the slave may
  /// be silent.
  ArmSample arm_at(core::Nanoseconds time_ns, core::Nanoseconds silence_ns) const;
  /// Returns another arm at a time likewise.
  ArmSample other_at(std::size_t other, core::Nanoseconds time_ns, core::Nanoseconds silence_ns) const;
  /// Returns the percept at a time likewise; of samples about different links the earlier one.
  PerceptSample percept_at(core::Nanoseconds time_ns, core::Nanoseconds silence_ns) const;
  GripperSample gripper_at(core::Nanoseconds time_ns, core::Nanoseconds silence_ns) const;
};

}  // namespace phantom::synthetic_viewer

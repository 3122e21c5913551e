#pragma once

#include "common/core/status.hpp"
#include "common/messages/arm_bounds.hpp"
#include "common/messages/teleoperation.hpp"
#include "phantom_idl/teleoperation.h"

namespace phantom::messages {

/// Convert from the topic's type; an error names the field, its value and what is allowed. `arm`: the arm
/// that the sample must describe. Allocates in errors only. Order and source are checked elsewhere
/// (dds::SourceGuard).
core::Expected<SlaveState> from_idl(const msg::SlaveState& message, const ArmBounds& arm = {});
core::Expected<MasterState> from_idl(const msg::MasterState& message, const ArmBounds& arm = {});
core::Expected<ViewPose> from_idl(const msg::ViewPose& message, const ArmBounds& arm = {});

/// Convert to the topic's type, without checks; the writer completes the stamp (dds::Stamper).
msg::SlaveState to_idl(const SlaveState& state);
msg::MasterState to_idl(const MasterState& state);
msg::ViewPose to_idl(const ViewPose& view);

}  // namespace phantom::messages

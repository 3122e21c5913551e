#pragma once

#include "common/core/status.hpp"
#include "common/messages/arm_bounds.hpp"
#include "common/messages/teleoperation.hpp"
#include "phantom_idl/teleoperation.hpp"

namespace phantom::messages {

/// Convert from the topic's type; an error names the field, its value and what is allowed. `arm`: the arm
/// that the sample must describe. Allocates in errors only. Order and source are checked elsewhere
/// (dds::SourceGuard).
core::Expected<SlaveState> from_idl(const msg::SlaveState& message, const ArmBounds& arm = {});
core::Expected<MasterState> from_idl(const msg::MasterState& message, const ArmBounds& arm = {});
core::Expected<GripperState> from_idl(const msg::GripperState& message, const ArmBounds& arm = {});
core::Expected<WristWrench> from_idl(const msg::WristWrench& message, const ArmBounds& arm = {});
core::Expected<ViewPose> from_idl(const msg::ViewPose& message, const ArmBounds& arm = {});
core::Expected<ViewPicture> from_idl(const msg::ViewPicture& message, const ArmBounds& arm = {});
core::Expected<CameraPicture> from_idl(const msg::CameraPicture& message, const ArmBounds& arm = {});
core::Expected<SensorPoints> from_idl(const msg::SensorPoints& message, const ArmBounds& arm = {});
core::Expected<OperatorCommand> from_idl(const msg::OperatorCommand& message, const ArmBounds& arm = {});
core::Expected<OperatorReply> from_idl(const msg::OperatorReply& message, const ArmBounds& arm = {});
/// As from_idl(), but leaves in `command` what could be read of an invalid message, to answer it.
core::Status read(const msg::OperatorCommand& message, OperatorCommand& command);

/// Convert to the topic's type, without checks; the writer completes the stamp (dds::Stamper).
msg::SlaveState to_idl(const SlaveState& state);
msg::MasterState to_idl(const MasterState& state);
msg::GripperState to_idl(const GripperState& state);
msg::WristWrench to_idl(const WristWrench& wrench);
msg::ViewPose to_idl(const ViewPose& view);
msg::ViewPicture to_idl(const ViewPicture& picture);
msg::CameraPicture to_idl(const CameraPicture& picture);
msg::SensorPoints to_idl(const SensorPoints& points);
msg::OperatorCommand to_idl(const OperatorCommand& command);
msg::OperatorReply to_idl(const OperatorReply& reply);

}  // namespace phantom::messages

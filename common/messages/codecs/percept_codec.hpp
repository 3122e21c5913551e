#pragma once

#include "common/core/status.hpp"
#include "common/messages/arm_bounds.hpp"
#include "common/messages/percept.hpp"
#include "phantom_idl/percept.hpp"

namespace phantom::messages {

/// Convert from the topic's type; an error names the field, its value and what is allowed. `arm`: the arm
/// that the sample must describe. Order and source are checked elsewhere (dds::SourceGuard).
core::Expected<DragField> from_idl(const msg::DragField& message, const ArmBounds& arm = {});
core::Expected<Percept> from_idl(const msg::Percept& message, const ArmBounds& arm = {});
core::Expected<InterestPoints> from_idl(const msg::InterestPoints& message, const ArmBounds& arm = {});
core::Expected<SkinPercept> from_idl(const msg::SkinPercept& message, const ArmBounds& arm = {});
core::Expected<HitAlert> from_idl(const msg::HitAlert& message, const ArmBounds& arm = {});
core::Expected<SensingCommand> from_idl(const msg::SensingCommand& message, const ArmBounds& arm = {});
core::Expected<SensingReply> from_idl(const msg::SensingReply& message, const ArmBounds& arm = {});
/// As from_idl(), but leaves in `command` what could be read of an invalid message, to answer it.
core::Status read(const msg::SensingCommand& message, SensingCommand& command);

/// Convert to the topic's type; the writer completes the stamp (dds::Stamper). They check only that a
/// command's names are not longer than the topic takes, and throw core::ConfigError.
msg::DragField to_idl(const DragField& field);
msg::Percept to_idl(const Percept& percept);
msg::InterestPoints to_idl(const InterestPoints& points);
msg::SkinPercept to_idl(const SkinPercept& skin);
msg::HitAlert to_idl(const HitAlert& alert);
msg::SensingCommand to_idl(const SensingCommand& command);
msg::SensingReply to_idl(const SensingReply& reply);

}  // namespace phantom::messages

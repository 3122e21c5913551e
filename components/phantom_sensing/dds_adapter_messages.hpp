#pragma once

// Conversion between topic types and the component's own types. Part of the DDS adapter: no other file sees
// idl types.

#include <string>

#include "common/dds/stamp.hpp"
#include "common/dds/topics.hpp"
#include "common/messages/percept_codec.hpp"
#include "common/messages/teleoperation_codec.hpp"
#include "common/workspace/workspace_assembler.hpp"
#include "components/phantom_sensing/contact_register.hpp"
#include "components/phantom_sensing/dds_adapter.hpp"
#include "components/phantom_sensing/dds_adapter_client.hpp"
#include "components/phantom_sensing/sensing_loop.hpp"

namespace phantom::phantom_sensing {

workspace::VersionDescription description_of(const msg::WorkspaceVersion& version);

/// Return the messages of one tick, without their stamps.
messages::DragField drag_field_of(const StepOutputs& outputs, const TickInfo& info, std::size_t joint_count);
messages::Percept percept_of(const StepOutputs& outputs, const TickInfo& info, std::size_t joint_count);
messages::InterestPoints interest_points_of(const StepOutputs& outputs, const TickInfo& info,
                                            const PhantomModel& model);
messages::HitAlert hit_alert_of(const percept::Alert& alert, bool cleared, const PhantomModel& model);

ContactRequest contact_request_of(const msg::SensingCommand& command);
/// Returns the command for a request, without its stamp. Throws core::ConfigError for a name that is too long
/// for the topic.
msg::SensingCommand to_message(const SensingRequest& request, const std::string& requester);
/// Returns the reply to a command, without stamp and echo.
msg::SensingReply reply_to(const msg::SensingCommand& command, const Answer& answer);

}  // namespace phantom::phantom_sensing

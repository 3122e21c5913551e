#pragma once

// Conversion between topic types and what the component works with. Part of the DDS adapter: nothing else
// sees idl.

#include <string>

#include "common/dds/stamp.hpp"
#include "common/dds/topics.hpp"
#include "common/robot/serial_arm.hpp"
#include "common/voxel/workspace_assembler.hpp"
#include "components/phantom_sensing/contact_register.hpp"
#include "components/phantom_sensing/dds_adapter.hpp"
#include "components/phantom_sensing/dds_adapter_client.hpp"
#include "components/phantom_sensing/sensing_loop.hpp"

namespace phantom::phantom_sensing {

/// Why a slave_state cannot be used, naming the field and what is allowed; empty if it can. Does not look at
/// its order.
std::string refusal(const msg::SlaveState& state, const robot::SerialArm& arm);
SlaveSample sample_of(const msg::SlaveState& state, core::Nanoseconds received_ns);

voxel::VersionDescription description_of(const msg::WorkspaceVersion& version);

/// Fill everything but the stamp.
void fill(msg::DragField& message, const StepOutputs& outputs, const TickInfo& info, std::size_t joint_count);
void fill(msg::Percept& message, const StepOutputs& outputs, const TickInfo& info, std::size_t joint_count);
void fill(msg::InterestPoints& message, const StepOutputs& outputs, const TickInfo& info,
          const PhantomModel& model);
void fill(msg::SkinPercept& message, const SkinView& view);
void fill(msg::HitAlert& message, const percept::Alert& alert, bool cleared, const PhantomModel& model);

ContactRequest contact_request_of(const msg::SensingCommand& command);
/// The command for a request, but for the stamp. Throws core::ConfigError for a name that does not fit.
msg::SensingCommand to_message(const SensingRequest& request, const std::string& requester);
/// The reply to a command, but for stamp and echo.
msg::SensingReply reply_to(const msg::SensingCommand& command, const Answer& answer);

}  // namespace phantom::phantom_sensing

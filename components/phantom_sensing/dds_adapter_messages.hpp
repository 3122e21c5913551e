#pragma once

// Conversion between topic types and the component's own types. Part of the DDS adapter: no other file sees
// idl types.

#include "common/dds/endpoints/stamp.hpp"
#include "common/dds/endpoints/topics.hpp"
#include "common/messages/codecs/percept_codec.hpp"
#include "common/messages/codecs/teleoperation_codec.hpp"
#include "components/phantom_sensing/dds_adapter.hpp"
#include "components/phantom_sensing/sensing_loop.hpp"

namespace phantom::phantom_sensing {

/// Return the messages of one tick, without their stamps.
messages::DragField drag_field_of(const StepOutputs& outputs, const TickInfo& info, std::size_t joint_count);
messages::Percept percept_of(const StepOutputs& outputs, const TickInfo& info, std::size_t joint_count);
messages::InterestPoints interest_points_of(const StepOutputs& outputs, const TickInfo& info,
                                            const PhantomModel& model);
messages::HitAlert hit_alert_of(const percept::Alert& alert, bool cleared, const PhantomModel& model);
messages::ModelDoubt model_doubt_of(const percept::ModelDoubt& doubt, bool holds, const PhantomModel& model);

}  // namespace phantom::phantom_sensing

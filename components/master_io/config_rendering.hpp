#pragma once

#include "common/core/joints.hpp"
#include "common/robot/kinematics/serial_arm.hpp"
#include "common/runtime/configuration/fields.hpp"
#include "components/master_io/config.hpp"

namespace phantom::master_io {

/// Readers of the sections of master_io.yaml that decide what the hand feels. All throw ConfigError. Call
/// them in this order: the device's stability limits bound the percept, and both bound the feedback.
/// `config.period_s` must be set before.

/// Reads section device: inertia, friction and limits, per type of joint and then of single joints. Those
/// that a master of fewer joints leads have its own (`config.mapping`, read before).
void read_device(const runtime::Fields& section, const robot::SerialArm& arm, Config& config);
/// Reads section percept.
void read_percept(const runtime::Fields& section, const robot::SerialArm& arm, Config& config);
/// Reads section feedback, with the slave's position loop, whose inertia is taken at `home`. Refuses every
/// 1/A, of any law, that is not stable with the expected delay.
void read_feedback(const runtime::Fields& section, const robot::SerialArm& arm, const core::JointArray& home,
                   Config& config);

}  // namespace phantom::master_io

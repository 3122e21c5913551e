#pragma once

#include "common/core/joints.hpp"
#include "common/robot/serial_arm.hpp"
#include "common/runtime/fields.hpp"
#include "components/master_io/config.hpp"

namespace phantom::master_io {

/// The sections of master_io.yaml that say what the hand feels. Each throws ConfigError. In this order: what
/// the device renders stably decides over the percept, and both over the feedback. `config.period_s` must be
/// there.

/// Section device: inertia, friction, limits, per type of joint and then of single joints.
void read_device(const runtime::Fields& section, const robot::SerialArm& arm, Config& config);
/// Section percept.
void read_percept(const runtime::Fields& section, const robot::SerialArm& arm, Config& config);
/// Section feedback, with the slave's position loop, whose inertia is taken at `home`. Refuses every 1/A, of
/// whatever law, that is not stable with the expected delay.
void read_feedback(const runtime::Fields& section, const robot::SerialArm& arm, const core::JointArray& home,
                   Config& config);

}  // namespace phantom::master_io

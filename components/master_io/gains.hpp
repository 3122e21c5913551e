#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/core/status.hpp"
#include "common/messages/teleoperation.hpp"
#include "components/master_io/devices/desk.hpp"
#include "components/master_io/master_io.hpp"

namespace phantom::master_io {

/// Rules for commands that set gains and law.
struct GainRules {
  std::vector<std::string> joints;  ///< their names
  teleop::FeedbackLimits limits;
  double contact_ratio = 1.0;  ///< 1/A in contact ÷ 1/A out of it
};

/// Returns the settings before the first command.
Settings initial_settings(const Config& config);

GainRules gain_rules(const Config& config, const robot::SerialArm& arm);

/// Returns the value of COMMAND_SET_PERCEPTS that a key of the desk asks for where `now` is in force.
int percepts_by_key(const teleop::PerceptChoice& now, PerceptKey key) noexcept;

/// Applies a command that is neither stop nor reset, or leaves `settings` unchanged and returns why, with
/// what is allowed. Refuses gains 1/A that are not stable with `round_trip_s`, the delay in force, and names
/// the joint with the lowest limit. A new law gets the 1/A that is configured for it and,
/// where the choice of percepts is automatic, the percepts that Table 6.1 has beside it. Not for the servo
/// thread.
core::Status apply_setting(const messages::OperatorCommand& command, const GainRules& rules,
                           double round_trip_s, Settings& settings);

}  // namespace phantom::master_io

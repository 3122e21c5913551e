#include "common/teleop/commands/operator_command.hpp"

#include <array>
#include <cmath>

#include "common/core/text.hpp"

namespace phantom::teleop {
namespace {

// The ranges are those of idl/teleoperation.idl, CommandKind.
constexpr std::array<CommandRule, kCommandKinds> kRules{
    {{"emergency_stop", true, true, false, 0, 0, false},
     {"reset", true, true, false, 0, 0, false},
     {"set_percept_gain", true, false, true, 0, 1000, false},
     {"set_feedback_gain", true, false, true, 0, 10, false},
     {"enable_percept", true, false, true, 0, 1, true},
     {"view_hold", false, false, true, 0, 1, true},
     {"view_node", false, false, true, 0, 14, true},
     {"set_law", true, false, true, 0, 4, true},
     {"mark", false, false, false, 0, 0, false},
     {"home", false, true, false, 0, 0, false},
     {"gripper_width", false, true, true, 0, 1, false},
     {"gripper_force", false, true, true, 0, 10000, false},
     {"tare_force_sensor", false, true, false, 0, 0, false},
     {"set_percepts", true, false, true, 0, 8, true},
     {"counterbalance", false, true, true, 0, 1, true}}};
constexpr CommandRule kUnknown{"unknown", true, false, false, 0, 0, false};

}  // namespace

const CommandRule& rule_of(CommandKind kind) noexcept {
  const auto number = static_cast<std::uint32_t>(kind);
  return number < kCommandKinds ? kRules[number] : kUnknown;
}

std::string value_refusal(CommandKind kind, double value) {
  const CommandRule& rule = rule_of(kind);
  if (!std::isfinite(value)) return "value is not a finite number";
  if (!rule.needs_value) return "";
  if (value >= rule.least && value <= rule.greatest && (!rule.whole || value == std::floor(value))) return "";
  return core::formatted("%s: value is %g; allowed: %s%g to %g", rule.name, value,
                         rule.whole ? "a whole number from " : "", rule.least, rule.greatest);
}

}  // namespace phantom::teleop

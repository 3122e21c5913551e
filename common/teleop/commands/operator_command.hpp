#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "common/teleop/commands/command_answers.hpp"

namespace phantom::teleop {

/// What an operator's command asks for. The numbers equal those of the topic's CommandKind.
enum class CommandKind : std::uint32_t {
  kEmergencyStop,
  kReset,
  kSetPerceptGain,
  kSetFeedbackGain,
  kEnablePercept,
  kViewHold,
  kViewNode,
  kSetLaw,
  kMark,
  kHome,
  kGripperWidth,
  kGripperForce,
  kTareForceSensor,
  kSetPercepts,
  kCounterbalance,
};
inline constexpr std::uint32_t kCommandKinds = 15;
inline constexpr auto kLastCommandKind = static_cast<CommandKind>(kCommandKinds - 1);

/// Name of a kind of command, who answers it, and which values it takes.
struct CommandRule {
  const char* name;              ///< e.g. "set_percept_gain"
  bool asks_master, asks_slave;  ///< whether that side answers it
  bool needs_value;
  double least, greatest;  ///< range of the value
  bool whole;              ///< only whole numbers
};
const CommandRule& rule_of(CommandKind kind) noexcept;
inline bool asks(CommandKind kind, Side side) noexcept {
  return side == Side::kMaster ? rule_of(kind).asks_master : rule_of(kind).asks_slave;
}
/// Returns why a command of that kind cannot have that value, naming what is allowed; empty if it can.
std::string value_refusal(CommandKind kind, double value);

/// A person's request to the running system, from the command line.
struct OperatorRequest {
  std::optional<CommandKind> kind;  ///< none: shows only how master and slave are
  /// The gain, the law's number, a width in m; 1 on, 0 off; the percepts, as COMMAND_SET_PERCEPTS has them.
  double value = 0.0;
  std::optional<double> gripper_force_N;  ///< requested first, and the width only if that is done
  std::string joint_name;                 ///< the joint whose gain is set; empty: all
  int joint = -1;                         ///< that joint's index from 0; −1: all
  double timeout_s = 5.0;
};

enum class OperatorOutcome {
  kDone,     ///< every side that must answer has confirmed
  kNotDone,  ///< a side refused, or did not confirm
  kNobody,   ///< no side answered at all
};

}  // namespace phantom::teleop

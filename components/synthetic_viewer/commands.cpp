#include "components/synthetic_viewer/commands.hpp"

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>

namespace phantom::synthetic_viewer {
namespace {

struct CommandRule {
  CommandKind kind;
  const char* name;
  bool needs_value;
  double least, greatest;
  bool whole;
};

// The ranges are those of idl/teleoperation.idl, CommandKind.
constexpr std::array<CommandRule, 8> kRules{
    {{CommandKind::kEmergencyStop, "emergency_stop", false, 0, 0, false},
     {CommandKind::kReset, "reset", false, 0, 0, false},
     {CommandKind::kSetPerceptGain, "set_percept_gain", true, 0, 1000, false},
     {CommandKind::kSetFeedbackGain, "set_feedback_gain", true, 0, 10, false},
     {CommandKind::kEnablePercept, "enable_percept", true, 0, 1, true},
     {CommandKind::kViewHold, "view_hold", true, 0, 1, true},
     {CommandKind::kViewNode, "view_node", true, 0, 14, true},
     {CommandKind::kSetLaw, "set_law", true, 0, 4, true}}};

std::string allowed_kinds() {
  std::string names;
  for (const CommandRule& rule : kRules) names += (names.empty() ? "" : ", ") + std::string(rule.name);
  return names;
}

}  // namespace

core::Status check_command(const Command& command) {
  for (const CommandRule& rule : kRules) {
    if (rule.kind != command.kind || !rule.needs_value) continue;
    const bool inside = command.value >= rule.least && command.value <= rule.greatest;
    if (inside && (!rule.whole || command.value == std::floor(command.value))) return core::Status::ok();
    std::ostringstream text;
    text << rule.name << ": value " << command.value << " is not allowed; allowed is "
         << (rule.whole ? "a whole number" : "a number") << " from " << rule.least << " to " << rule.greatest;
    return core::Status::invalid_argument(text.str());
  }
  return core::Status::ok();
}

core::Expected<Command> parse_command(const std::string& text) {
  const auto json = nlohmann::json::parse(text, nullptr, false);
  if (!json.is_object())
    return core::Status::invalid_argument(R"(a JSON object {"kind": …, "value": …} is expected)");
  for (const auto& item : json.items()) {
    if (item.key() != "kind" && item.key() != "value") {
      return core::Status::invalid_argument("unknown key '" + item.key() + "'; allowed are kind and value");
    }
  }
  const auto kind = json.find("kind");
  if (kind == json.end() || !kind->is_string()) {
    return core::Status::invalid_argument("kind must be one of " + allowed_kinds());
  }
  for (const CommandRule& rule : kRules) {
    if (kind->get<std::string>() != rule.name) continue;
    Command command{rule.kind, 0.0};
    if (rule.needs_value) {
      const auto value = json.find("value");
      if (value == json.end() || !value->is_number()) {
        return core::Status::invalid_argument(std::string(rule.name) + ": value must be a number");
      }
      command.value = value->get<double>();
    }
    if (const core::Status status = check_command(command); !status.is_ok()) return status;
    return command;
  }
  return core::Status::invalid_argument("unknown kind '" + kind->get<std::string>() + "'; allowed are " +
                                        allowed_kinds());
}

}  // namespace phantom::synthetic_viewer

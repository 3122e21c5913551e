#include "components/synthetic_viewer/commands.hpp"

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>

#include "common/core/units.hpp"

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
constexpr std::array<CommandRule, 9> kRules{
    {{CommandKind::kEmergencyStop, "emergency_stop", false, 0, 0, false},
     {CommandKind::kReset, "reset", false, 0, 0, false},
     {CommandKind::kSetPerceptGain, "set_percept_gain", true, 0, 1000, false},
     {CommandKind::kSetFeedbackGain, "set_feedback_gain", true, 0, 10, false},
     {CommandKind::kEnablePercept, "enable_percept", true, 0, 1, true},
     {CommandKind::kViewHold, "view_hold", true, 0, 1, true},
     {CommandKind::kViewNode, "view_node", true, 0, 14, true},
     {CommandKind::kSetLaw, "set_law", true, 0, 4, true},
     {CommandKind::kMark, "mark", false, 0, 0, false}}};

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

namespace {

using Json = nlohmann::json;

core::Status bad(const std::string& problem) { return core::Status::invalid_argument(problem); }

/// Returns whether a value is a finite number within limits.
bool within(const Json& value, double least, double greatest) {
  return value.is_number() && value.get<double>() >= least && value.get<double>() <= greatest;
}

core::Status read_key(const std::string& key, const Json& value, ViewRequest& request) {
  if (key == "view") {
    const auto view = value.is_string() ? view_from_name(value.get<std::string>()) : std::nullopt;
    if (!view) return bad("view must be one of main, hit, tool");
    request.view = *view;
  } else if (key == "orbit_deg") {
    if (!value.is_array() || value.size() != 2 || !within(value[0], -180, 180) ||
        !within(value[1], -180, 180))
      return bad("orbit_deg must be [azimuth, elevation], each from -180 to 180");
    request.azimuth_rad = core::kRadPerDegree * value[0].get<double>();
    request.elevation_rad = core::kRadPerDegree * value[1].get<double>();
  } else if (key == "zoom") {
    if (!within(value, 0.1, 10)) return bad("zoom must be a number from 0.1 to 10");
    request.zoom = value.get<double>();
  } else if (key == "home") {
    if (!value.is_boolean()) return bad("home must be true or false");
    request.home = value.get<bool>();
  } else if (key == "record") {
    if (!value.is_boolean()) return bad("record must be true or false");
    request.record = value.get<bool>();
  } else {
    return bad("unknown key '" + key + "'; allowed are view, orbit_deg, zoom, home and record");
  }
  return core::Status::ok();
}

}  // namespace

core::Expected<ViewRequest> parse_view_request(const std::string& text) {
  const Json json = Json::parse(text, nullptr, false);
  if (!json.is_object() || !json.contains("view")) return bad(R"(a JSON object {"view": …} is expected)");
  ViewRequest request;
  for (const auto& item : json.items()) {
    if (core::Status status = read_key(item.key(), item.value(), request); !status.is_ok()) return status;
  }
  return request;
}

}  // namespace phantom::synthetic_viewer

#include "components/synthetic_viewer/page/commands.hpp"

#include <array>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "common/core/text.hpp"
#include "common/core/units.hpp"

namespace phantom::synthetic_viewer {
namespace {

using Json = nlohmann::json;

core::Status bad(const std::string& problem) { return core::Status::invalid_argument(problem); }

std::string allowed_kinds() {
  std::string names;
  for (std::uint32_t kind = 0; kind < teleop::kCommandKinds; ++kind)
    core::add_to_list(names, teleop::rule_of(static_cast<CommandKind>(kind)).name);
  return names;
}

}  // namespace

std::optional<web::Role> role_for(teleop::CommandKind kind) {
  using enum teleop::CommandKind;
  if (kind == kEmergencyStop) return std::nullopt;
  return kind == kSetLaw || kind == kSetFeedbackGain || kind == kCounterbalance ? web::Role::kConfigure
                                                                                : web::Role::kOperate;
}

core::Expected<Command> parse_command(const std::string& text) {
  const Json json = Json::parse(text, nullptr, false);
  if (!json.is_object()) return bad(R"(a JSON object {"kind": …, "value": …} is expected)");
  for (const auto& item : json.items()) {
    if (item.key() != "kind" && item.key() != "value")
      return bad("unknown key '" + item.key() + "'; allowed are kind and value");
  }
  const auto kind = json.find("kind"), value = json.find("value");
  for (std::uint32_t number = 0; number < teleop::kCommandKinds; ++number) {
    Command command{.kind = static_cast<CommandKind>(number)};
    const teleop::CommandRule& rule = teleop::rule_of(command.kind);
    if (kind == json.end() || *kind != rule.name) continue;
    if (rule.needs_value) {
      if (value == json.end() || !value->is_number())
        return bad(std::string(rule.name) + ": value must be a number");
      command.value = value->get<double>();
    }
    if (const std::string why = teleop::value_refusal(command.kind, command.value); !why.empty())
      return bad(why);
    return command;
  }
  return bad("kind must be one of " + allowed_kinds());
}

namespace {

/// Returns whether a value is a finite number within limits.
bool within(const Json& value, double least, double greatest) {
  return value.is_number() && value.get<double>() >= least && value.get<double>() <= greatest;
}

core::Status read_key(const std::string& key, const Json& value, ViewRequest& request) {
  if (key == "view") {
    const auto view = value.is_string() ? view_from_name(value.get<std::string>()) : std::nullopt;
    if (!view) return bad("view must be one of main, hit, tool, camera");
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
  } else if (key == "home" || key == "record" || key == "approach") {
    if (!value.is_boolean()) return bad(key + " must be true or false");
    (key == "home"     ? request.home
     : key == "record" ? request.record.emplace()
                       : request.approach.emplace()) = value.get<bool>();
  } else {
    return bad("unknown key '" + key + "'; allowed are view, orbit_deg, zoom, home, record and approach");
  }
  return core::Status::ok();
}

}  // namespace

core::Expected<CarryRequest> parse_carry_request(const std::string& text) {
  const Json json = Json::parse(text, nullptr, false);
  if (!json.is_object() || json.size() != 2 || !json.contains("object") || !json.contains("attach"))
    return bad(R"(a JSON object {"object": …, "attach": …} is expected)");
  const Json &object = json["object"], &attach = json["attach"];
  constexpr std::size_t kMaxName = 64;
  if (!object.is_string() || object.get_ref<const std::string&>().empty() ||
      object.get_ref<const std::string&>().size() > kMaxName)
    return bad("object must be a name of 1 to 64 bytes");
  if (!attach.is_boolean()) return bad("attach must be true or false");
  return CarryRequest{object.get<std::string>(), attach.get<bool>()};
}

namespace {

/// What may be done with a thing that cameras see, as the page has it.
constexpr std::array<std::pair<const char*, messages::WorkspaceOperation>, 4> kDecisions{
    {{"call", messages::WorkspaceOperation::kName},
     {"freeze", messages::WorkspaceOperation::kFreeze},
     {"discard", messages::WorkspaceOperation::kDiscard},
     {"restore", messages::WorkspaceOperation::kRestore}}};

core::Expected<CorrectionRequest> parse_decision(const Json& json, const std::string& key,
                                                 messages::WorkspaceOperation decision) {
  const auto is_name = [](const Json& name) {
    constexpr std::size_t kMaxName = 64;
    return name.is_string() && !name.get_ref<const std::string&>().empty() &&
           name.get_ref<const std::string&>().size() <= kMaxName;
  };
  if (!is_name(json[key])) return bad(key + " must be the name of a thing, of 1 to 64 bytes");
  CorrectionRequest request{.live = json[key].get<std::string>(), .decision = decision};
  const bool names = decision == messages::WorkspaceOperation::kName;
  if (json.size() != (names ? 2 : 1) || names != json.contains("name"))
    return bad(R"(name must be there with call, and with nothing else)");
  if (names && !is_name(json["name"])) return bad("name must be a name of 1 to 64 bytes");
  if (names) request.name = json["name"].get<std::string>();
  return request;
}

}  // namespace

core::Expected<CorrectionRequest> parse_correction_request(const std::string& text) {
  const Json json = Json::parse(text, nullptr, false);
  if (json.is_object())
    for (const auto& [key, decision] : kDecisions)
      if (json.contains(key)) return parse_decision(json, key, decision);
  if (!json.is_object() || json.size() != 1 ||
      (!json.contains("correct") && !json.contains("found") && !json.contains("undo")))
    return bad(
        R"(a JSON object {"correct": …}, {"found": …}, {"undo": …}, {"freeze": …}, {"discard": …}, {"restore": …})"
        R"( or {"call": …, "name": …} is expected)");
  if (json.contains("found")) {
    const Json& object = json["found"];
    if (!object.is_string() || object.get_ref<const std::string&>().empty())
      return bad("found must be the name of the object that is put where a camera has found it");
    return CorrectionRequest{.found = object.get<std::string>()};
  }
  if (json.contains("undo")) {
    const Json& object = json["undo"];
    if (!object.is_string() || object.get<std::string>().empty())
      return bad("undo must be the name of the object whose newest change is undone");
    return CorrectionRequest{.undo = object.get<std::string>()};
  }
  const Json& doubt = json["correct"];
  if (!doubt.is_number_integer() || !within(doubt, 1, std::numeric_limits<std::uint32_t>::max()))
    return bad("correct must be the running number of a doubt, 1 or more");
  return CorrectionRequest{.doubt = doubt.get<std::uint32_t>()};
}

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

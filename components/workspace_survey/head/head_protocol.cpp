#include "components/workspace_survey/head/head_protocol.hpp"

#include <spdlog/fmt/fmt.h>

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <optional>

#include "common/core/printable.hpp"
#include "common/core/units.hpp"

namespace phantom::workspace_survey {
namespace {

using core::ErrorCode;
using core::Expected;
using core::Status;
using nlohmann::json;
using survey::Reading;

constexpr std::array kOperations{HeadOperation::kDescribe, HeadOperation::kAim, HeadOperation::kMeasure};
constexpr std::size_t kMaxShown = 200;  // bytes of a text of the other end

std::string excerpt(const std::string& text) {
  return core::printable(text.substr(0, kMaxShown)) + (text.size() > kMaxShown ? "..." : "");
}

/// Returns the object in a line.
Expected<json> object_in(const std::string& line) {
  json object = json::parse(line, nullptr, false);
  if (!object.is_object())
    return Status::invalid_argument("'" + excerpt(line) + "' is no JSON object; allowed: one per line");
  return object;
}

/// Returns a number of an object; an error if it is not there, or none.
Expected<double> number_in(const json& object, const char* key) {
  const auto found = object.find(key);
  if (found == object.end() || !found->is_number())
    return Status::invalid_argument(std::string(key) + " is missing or no number; allowed: a finite number");
  const double value = found->get<double>();
  if (!std::isfinite(value))
    return Status::invalid_argument(std::string(key) + " is not finite; allowed: a finite number");
  return value;
}

Expected<std::uint64_t> id_in(const json& object) {
  const auto found = object.find("id");
  if (found == object.end() || !found->is_number_unsigned())
    return Status::invalid_argument("id is missing or no whole number; allowed: the request's");
  return found->get<std::uint64_t>();
}

/// Returns the object of a reply, or the error that it reports.
Expected<json> answer_in(const std::string& line) {
  auto object = object_in(line);
  if (!object) return object;
  const auto problem = object->find("error");
  if (problem == object->end()) return object;
  if (!problem->is_string())
    return Status::invalid_argument("error is no text; allowed: one sentence for a person");
  return Status(ErrorCode::kUnavailable, excerpt(problem->get<std::string>()));
}

/// Reads two numbers, the first not above the second, both within ±`most`.
Status read_limits(const json& object, const char* key, double most, double& least_out, double& most_out) {
  const auto found = object.find(key);
  const bool is_pair = found != object.end() && found->is_array() && found->size() == 2 &&
                       (*found)[0].is_number() && (*found)[1].is_number();
  if (is_pair) {
    least_out = (*found)[0].get<double>();
    most_out = (*found)[1].get<double>();
    if (least_out <= most_out && least_out >= -most && most_out <= most) return {};
  }
  return Status::invalid_argument(
      fmt::format("{} is not [least, greatest] of within +-{:.4g} rad", key, most));
}

/// Checks that a direction is where the head was sent, or stands.
Status check_direction(const Reading& direction, const Reading& there) {
  for (const auto& [name, angle_rad, there_rad] :
       {std::tuple{"pan_rad", direction.pan_rad, there.pan_rad},
        std::tuple{"tilt_rad", direction.tilt_rad, there.tilt_rad}}) {
    if (std::abs(angle_rad - there_rad) <= kHeadTolerance_rad) continue;
    return Status::invalid_argument(
        fmt::format("{} is {:.5f}; allowed: within {:.4f} of {:.5f}, where the head was sent", name,
                    angle_rad, kHeadTolerance_rad, there_rad));
  }
  return {};
}

/// Reads pan and tilt of an object.
Status read_direction(const json& object, Reading& direction) {
  const auto pan = number_in(object, "pan_rad"), tilt = number_in(object, "tilt_rad");
  if (!pan) return pan.status();
  if (!tilt) return tilt.status();
  direction.pan_rad = *pan;
  direction.tilt_rad = *tilt;
  return {};
}

json json_of(const Reading& reading) {
  return {{"range_m", reading.range_m}, {"pan_rad", reading.pan_rad}, {"tilt_rad", reading.tilt_rad}};
}

}  // namespace

const char* name_of(HeadOperation operation) {
  switch (operation) {
    case HeadOperation::kDescribe:
      return "describe";
    case HeadOperation::kAim:
      return "aim";
    case HeadOperation::kMeasure:
      return "measure";
  }
  return "";
}

Expected<HeadRequest> parse_head_request(const std::string& line) {
  const auto object = object_in(line);
  if (!object) return object.status();
  const auto id = id_in(*object);
  if (!id) return id.status();
  HeadRequest request{.id = *id};
  const auto what = object->find("request");
  const std::string wanted = what != object->end() && what->is_string() ? what->get<std::string>() : "";
  const auto known = std::find_if(kOperations.begin(), kOperations.end(),
                                  [&](HeadOperation operation) { return wanted == name_of(operation); });
  if (known == kOperations.end())
    return Status::invalid_argument("request is '" + excerpt(wanted) + "'; allowed: describe, aim, measure");
  request.operation = *known;
  if (request.operation == HeadOperation::kAim) {
    Reading direction;
    if (auto read = read_direction(*object, direction); !read) return read;
    request.pan_rad = direction.pan_rad;
    request.tilt_rad = direction.tilt_rad;
  } else if (request.operation == HeadOperation::kMeasure) {
    const auto readings = number_in(*object, "readings");
    if (!readings || *readings != std::floor(*readings) || *readings < 1 || *readings > kMaxHeadReadings)
      return Status::invalid_argument(
          fmt::format("readings is missing or no number of them; allowed: 1 to {}", kMaxHeadReadings));
    request.readings = static_cast<int>(*readings);
  }
  return request;
}

std::string reply_line(std::uint64_t id, const HeadDescription& description) {
  return json{{"id", id},
              {"contract", kHeadContract},
              {"driver", description.driver},
              {"pan_rad", {description.min_pan_rad, description.max_pan_rad}},
              {"tilt_rad", {description.min_tilt_rad, description.max_tilt_rad}}}
      .dump();
}

std::string reply_line(std::uint64_t id, const Reading& direction) {
  return json{{"id", id}, {"pan_rad", direction.pan_rad}, {"tilt_rad", direction.tilt_rad}}.dump();
}

std::string reply_line(std::uint64_t id, const std::vector<Reading>& readings) {
  json all = json::array();
  for (const Reading& reading : readings) all.push_back(json_of(reading));
  return json{{"id", id}, {"readings", all}}.dump();
}

std::string error_line(std::uint64_t id, const std::string& problem) {
  return json{{"id", id}, {"error", core::printable(problem)}}.dump();
}

std::string request_line(const HeadRequest& request) {
  json object{{"id", request.id}, {"request", name_of(request.operation)}};
  if (request.operation == HeadOperation::kAim) {
    object["pan_rad"] = request.pan_rad;
    object["tilt_rad"] = request.tilt_rad;
  } else if (request.operation == HeadOperation::kMeasure) {
    object["readings"] = request.readings;
  }
  return object.dump();
}

Expected<std::uint64_t> reply_id(const std::string& line) {
  const auto object = object_in(line);
  return object ? id_in(*object) : object.status();
}

Expected<HeadDescription> parse_description(const std::string& line) {
  const auto object = answer_in(line);
  if (!object) return object.status();
  const auto contract = number_in(*object, "contract");
  if (!contract || *contract != kHeadContract)
    return Status::invalid_argument(
        fmt::format("contract is missing or another; allowed: {}", kHeadContract));
  HeadDescription description;
  const auto driver = object->find("driver");
  if (driver == object->end() || !driver->is_string() || driver->get<std::string>().empty())
    return Status::invalid_argument("driver is missing or no text; allowed: the driver's name");
  description.driver = excerpt(driver->get<std::string>());
  if (auto read = read_limits(*object, "pan_rad", 2 * std::numbers::pi, description.min_pan_rad,
                              description.max_pan_rad);
      !read)
    return read;
  if (auto read = read_limits(*object, "tilt_rad", 2 * std::numbers::pi, description.min_tilt_rad,
                              description.max_tilt_rad);
      !read)
    return read;
  return description;
}

Expected<Reading> parse_direction(const std::string& line, const Reading& asked) {
  const auto object = answer_in(line);
  if (!object) return object.status();
  Reading direction;
  if (auto read = read_direction(*object, direction); !read) return read;
  if (auto checked = check_direction(direction, asked); !checked) return checked;
  return direction;
}

Expected<std::vector<Reading>> parse_readings(const std::string& line, const survey::RangeHead& head,
                                              const Reading& pointing, int count) {
  const auto object = answer_in(line);
  if (!object) return object.status();
  const auto list = object->find("readings");
  if (list == object->end() || !list->is_array() || list->size() != static_cast<std::size_t>(count))
    return Status::invalid_argument(
        fmt::format("readings is missing or not a list of {}; allowed: as many as were asked for", count));
  std::vector<Reading> readings;
  for (const json& entry : *list) {
    const std::string about = fmt::format("reading {}: ", readings.size() + 1);
    if (!entry.is_object()) return Status::invalid_argument(about + "is no JSON object");
    const auto range_m = number_in(entry, "range_m");
    if (!range_m) return Status::invalid_argument(about + range_m.status().message());
    Reading reading{*range_m, 0.0, 0.0};
    Status checked = read_direction(entry, reading);
    if (checked) checked = check_direction(reading, pointing);
    if (checked) checked = survey::check_reading(head, reading);
    if (!checked) return Status::invalid_argument(about + checked.message());
    readings.push_back(reading);
  }
  return readings;
}

}  // namespace phantom::workspace_survey

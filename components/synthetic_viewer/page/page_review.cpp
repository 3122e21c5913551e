#include "components/synthetic_viewer/page/page_review.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>

#include "common/runtime/process/command_line.hpp"
#include "common/teleop/coupling/link_state.hpp"

namespace phantom::synthetic_viewer {
namespace {

using Json = nlohmann::json;

constexpr double kMax_s = 1e9;  // of any recording

std::string dumped(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

Json mark_json(const AlertMark& mark, core::Nanoseconds begin_ns) {
  return {{"alert", mark.alert},
          {"t", core::seconds(mark.raised_ns - begin_ns)},
          {"cleared_t", mark.cleared_ns == 0 ? Json() : Json(core::seconds(mark.cleared_ns - begin_ns))},
          {"rule", name_of(mark.rule)},
          {"link", mark.link},
          {"object", mark.object},
          {"interest_point", mark.interest_point},
          {"speed_m_s", mark.speed_m_s}};
}

/// Appends the numbers of the columns as a JSON list.
void append_numbers(std::string& text, const std::vector<ReducedSeries::Span>& columns,
                    float ReducedSeries::Span::*bound) {
  text += '[';
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const float value = columns[i].*bound;
    if (i > 0) text += ',';
    if (std::isnan(value))
      text += "null";
    else
      fmt::format_to(std::back_inserter(text), "{:.4g}", value);
  }
  text += ']';
}

}  // namespace

std::string review_json(const Review& review) {
  Json alerts = Json::array(), series = Json::array(), states = Json::array();
  for (const AlertMark& mark : review.marks()) alerts.push_back(mark_json(mark, review.begin_ns()));
  for (const ReviewSeries& one : review.series())
    series.push_back({{"name", one.name}, {"label", one.label}, {"unit", one.unit}, {"plot", one.plot}});
  for (int state = 0; state <= static_cast<int>(LinkState::kStopped); ++state)
    states.push_back(label_of(static_cast<LinkState>(state)));
  return dumped({{"begin_utc_ms", review.begin_ns() / 1'000'000},
                 {"duration_s", review.duration_s()},
                 {"alerts", alerts},
                 {"series", series},
                 {"link_states", states},
                 {"problems", review.problems()}});
}

core::Expected<SeriesRequest> parse_series_request(const std::string& names, const std::string& from,
                                                   const std::string& to, const std::string& columns) {
  SeriesRequest request;
  std::istringstream list(names);
  for (std::string name; std::getline(list, name, ',');) {
    if (std::ranges::find(request.names, name) == request.names.end()) request.names.push_back(name);
  }
  constexpr std::size_t kMaxNames = 64;
  if (request.names.empty() || request.names.size() > kMaxNames)
    return core::Status::invalid_argument(
        "names must be 1 to 64 names of series, separated by commas; GET /review lists them");
  const auto begin = runtime::number_of(from), end = runtime::number_of(to);
  if (!begin || !end || !(std::abs(*begin) <= kMax_s) || !(std::abs(*end) <= kMax_s) || !(*begin < *end))
    return core::Status::invalid_argument(
        "from and to must be numbers, in s from the recording's beginning, to above from");
  const auto count = runtime::number_of(columns);
  if (!count || !(*count >= 1 && *count <= SeriesRequest::kMaxColumns) || *count != std::floor(*count))
    return core::Status::invalid_argument("columns must be a whole number from 1 to 4000");
  request.from_s = *begin;
  request.to_s = *end;
  request.columns = static_cast<std::size_t>(*count);
  return request;
}

core::Expected<std::string> series_json(const Review& review, const SeriesRequest& request) {
  const auto at = [&review](double s) { return review.begin_ns() + core::from_seconds(s); };
  std::string text = fmt::format(R"({{"from":{},"to":{},"series":{{)", request.from_s, request.to_s);
  for (const std::string& name : request.names) {
    const auto found = std::ranges::find(review.series(), name, &ReviewSeries::name);
    if (found == review.series().end())
      return core::Status::not_found("there is no series '" + name + "'; GET /review lists them");
    const auto columns = found->values.columns(at(request.from_s), at(request.to_s), request.columns);
    if (text.back() != '{') text += ',';
    text += '"' + name + R"(":{"least":)";
    append_numbers(text, columns, &ReducedSeries::Span::least);
    text += R"(,"greatest":)";
    append_numbers(text, columns, &ReducedSeries::Span::greatest);
    text += '}';
  }
  return text + "}}";
}

core::Expected<ReviewRequest> parse_review_request(const std::string& text) {
  const Json json = Json::parse(text, nullptr, false);
  if (!json.is_object())
    return core::Status::invalid_argument(R"(a JSON object {"t": …, "play": …, "rate": …} is expected)");
  ReviewRequest request;
  for (const auto& item : json.items()) {
    const Json& value = item.value();
    if (item.key() == "t" || item.key() == "rate") {
      if (!value.is_number()) return core::Status::invalid_argument(item.key() + " must be a number");
      (item.key() == "t" ? request.t_s : request.rate) = value.get<double>();
    } else if (item.key() == "play") {
      if (!value.is_boolean()) return core::Status::invalid_argument("play must be true or false");
      request.play = value.get<bool>();
    } else {
      return core::Status::invalid_argument("unknown key '" + item.key() + "'; allowed are t, play and rate");
    }
  }
  return request;
}

}  // namespace phantom::synthetic_viewer

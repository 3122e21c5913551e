#include "components/phantom_session/report_page.hpp"

#include <map>
#include <nlohmann/json.hpp>
#include <string_view>
#include <utility>
#include <vector>

#include "common/core/text.hpp"

namespace phantom::phantom_session {

namespace web {  // what CMakeLists.txt embeds
extern const char* const kEnglishTexts;
extern const char* const kGermanTexts;
extern const char* const kTokensCss;
extern const char* const kReportCss;
}  // namespace web

namespace {

using Json = nlohmann::ordered_json;

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    const char* name = c == '<'   ? "&lt;"
                       : c == '>' ? "&gt;"
                       : c == '&' ? "&amp;"
                       : c == '"' ? "&quot;"
                                  : nullptr;
    out += name != nullptr ? std::string(name) : std::string(1, c);
  }
  return out;
}

/// The words and figures of a language, ready for the page.
class Speech {
 public:
  explicit Speech(Language language)
      : german_(language == Language::kGerman),
        texts_(Json::parse(german_ ? web::kGermanTexts : web::kEnglishTexts)
                   .get<std::map<std::string, std::string>>()) {}

  /// Returns the text of that key; {name} in it is replaced by the value of that name. Throws
  /// std::out_of_range if there is none.
  std::string operator()(const std::string& key,
                         const std::vector<std::pair<std::string_view, std::string>>& values = {}) const {
    std::string text = escaped(texts_.at(key));
    for (const auto& [name, value] : values) {
      const std::string place = std::string("{").append(name).append("}");
      text.replace(text.find(place), place.size(), value);
    }
    return text;
  }
  /// Returns what a file has in English words, in this language where it is known.
  std::string words(const std::string& group, const std::string& english) const {
    const auto found = texts_.find(group + "." + english);
    return escaped(found == texts_.end() ? english : found->second);
  }
  std::string cell(const Json& value) const {
    if (value.is_null()) return "–";
    if (value.is_string()) return escaped(value.get<std::string>());
    if (value.is_boolean()) return (*this)(value.get<bool>() ? "value.yes" : "value.no");
    if (!value.is_number_float()) return escaped(value.dump());
    std::string figure = core::formatted("%.4g", value.get<double>());
    if (const std::size_t point = figure.find('.'); german_ && point != std::string::npos)
      figure[point] = ',';
    return figure;
  }

 private:
  bool german_;
  std::map<std::string, std::string> texts_;
};

std::string row(const std::vector<std::string>& cells, const char* tag = "td") {
  std::string out = "<tr>";
  for (const auto& text : cells) out += std::string("<") + tag + ">" + text + "</" + tag + ">";
  return out + "</tr>\n";
}

/// A member of summary.json, and the factor from its unit to the one that its text names: the text's key is
/// that of the table and of the member.
struct Field {
  const char* key;
  double scale = 1.0;
};
using Fields = std::vector<Field>;

constexpr double kToMilli = 1e3, kMicroToMilli = 1e-3, kToMega = 1e-6;

std::string cell(const Speech& speech, const Json& object, const std::string& table, const Field& field) {
  const Json value = object.value(field.key, Json());
  if (table == "hit" && field.key == std::string_view("rule") && value.is_string())
    return speech.words("rule", value.get<std::string>());
  if (table == "set" && field.key == std::string_view("set") && value.is_string()) {
    const auto words = value.get<std::string>();  // "b1: SCTFB, balanced arm: drag and tone"
    const std::size_t colon = words.rfind(": ");
    if (colon != std::string::npos) {
      std::string out = speech.words("row", words.substr(0, colon));
      return out.append(": ").append(speech.words("chosen", words.substr(colon + 2)));
    }
  }
  return speech.cell(field.scale != 1.0 && value.is_number() ? Json(field.scale * value.get<double>())
                                                             : value);
}

std::string heading(const Speech& speech, const std::string& table) {
  return "<h2>" + speech(table + ".title") + "</h2>\n";
}

// Returns a table of two columns: name and value.
std::string pairs_table(const Speech& speech, const Json& object, const std::string& table,
                        const Fields& fields) {
  std::string out = "<table class=\"pairs\">\n";
  for (const Field& field : fields)
    out += row({speech(table + "." + field.key), cell(speech, object, table, field)});
  return out + "</table>\n";
}

// Returns a table with one row per entry of an array or object. An object's keys fill the first column.
std::string grid_table(const Speech& speech, const Json& entries, const std::string& table,
                       const Fields& fields) {
  if (entries.empty()) return "<p>" + speech("value.none") + "</p>\n";
  std::vector<std::string> head;
  if (entries.is_object()) head.push_back(speech(table + ".name"));
  for (const Field& field : fields) head.push_back(speech(table + "." + field.key));
  std::string out = "<div class=\"wide\"><table>\n" + row(head, "th");
  for (const auto& [name, entry] : entries.items()) {
    std::vector<std::string> cells;
    if (entries.is_object()) cells.push_back(escaped(name));
    for (const Field& field : fields) cells.push_back(cell(speech, entry, table, field));
    out += row(cells);
  }
  return out + "</table></div>\n";
}

// Returns a table with one row per topic.
std::string counts_table(const Speech& speech, const Json& counts) {
  std::string out = "<table>\n" + row({speech("deadline.topic"), speech("deadline.missed")}, "th");
  for (const auto& [topic, count] : counts.items()) out += row({escaped(topic), speech.cell(count)});
  return out + "</table>\n";
}

const Fields kFelt{{"onset_distance_m", kToMilli},
                   {"peak_torque_nm"},
                   {"contact_speed_with", kToMilli},
                   {"contact_speed_without", kToMilli}};
const Fields kPerceptSets{{"t"}, {"set"}, {"automatic"}};
const Fields kForeignWriters{{"t"}, {"topic"}, {"process"}, {"samples"}};
const Fields kReaches{{"n"},
                      {"t"},
                      {"percept"},
                      {"onset_distance_m", kToMilli},
                      {"peak_torque_nm"},
                      {"contact_t"},
                      {"contact_speed_m_s", kToMilli},
                      {"object"},
                      {"lead_s"},
                      {"alarms"}};
const Fields kAlarms{{"entries"}, {"most_in_a_reach"}, {"alerts"}};
const Fields kLeadTimes{{"contacts"}, {"unannounced"}, {"median_s"}, {"least_s"}, {"share_in_time"}};
const Fields kHits{{"t"}, {"alert"}, {"link"}, {"object"}, {"rule"}};
const Fields kRoundTrip{{"p50_us", kMicroToMilli},
                        {"p99_us", kMicroToMilli},
                        {"p999_us", kMicroToMilli},
                        {"max_us", kMicroToMilli},
                        {"n"}};
const Fields kLoops{{"rate_hz"}, {"nominal_hz"},  {"p50_us"}, {"p99_us"},
                    {"max_us"},  {"work_p50_us"}, {"ticks"},  {"slips"}};
const Fields kWorkspace{{"version"}, {"bricks"}, {"bytes", kToMega}, {"build_seconds"}};
const Fields kLive{{"images"}, {"versions"}, {"most_voxels"}};
const Fields kSpreads{{"p50"}, {"p99"}, {"max"}, {"n"}};
const Fields kForgotten{{"components"}, {"reaches"}, {"hits"}};
const Fields kProcesses{{"exit"}, {"restarts"}};

/// Numbers the page's figures in their order.
class Figures {
 public:
  explicit Figures(const Speech& speech) : speech_(speech) {}
  /// `caption`: HTML.
  std::string operator()(const std::string& file, const std::string& caption) {
    const std::string text =
        speech_("page.figure", {{"number", std::to_string(++number_)}, {"caption", caption}});
    return "<figure><img src=\"" + escaped(file) + "\" alt=\"" + text + "\"><figcaption>" + text +
           "</figcaption></figure>\n";
  }

 private:
  const Speech& speech_;
  int number_ = 0;
};

// The English page hands a browser that prefers German over to the German one, unless it was asked for.
std::string opening(const Speech& speech, Language language) {
  const bool german = language == Language::kGerman;
  const std::string title = speech("page.title");
  std::string out = std::string("<!doctype html>\n<html lang=\"") + (german ? "de" : "en") +
                    "\"><head><meta charset=\"utf-8\">"
                    "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"><title>" +
                    title + "</title>\n<style>\n" + web::kTokensCss + "\n" + web::kReportCss + "\n</style>\n";
  if (!german)
    out += "<script>if (/^de/.test(navigator.language) && !location.hash) location.replace('" +
           std::string(report_file(Language::kGerman)) + "');</script>\n";
  return out + "</head><body>\n<header><h1>" + title + "</h1><a href=\"" +
         report_file(german ? Language::kEnglish : Language::kGerman) + "#chosen\" lang=\"" +
         (german ? "en" : "de") + "\">" + speech("page.other_language") + "</a></header>\n<main>\n";
}

std::string views(const Speech& speech, const Json& list, Figures& figure) {
  std::string out;
  for (const auto& view : list) {
    if (!view.contains("png")) continue;
    const auto of = [&](const char* key) { return speech.cell(view.value(key, Json())); };
    out += figure(view["png"].get<std::string>(),
                  speech("view.caption", {{"alert", of("alert")}, {"t", of("t")}, {"node", of("node")}}));
  }
  return out;
}

}  // namespace

const char* report_file(Language language) noexcept {
  return language == Language::kGerman ? "index.de.html" : "index.html";
}

std::string report_page(const std::string& summary_json, Language language) {
  const Json summary = Json::parse(summary_json);
  const Speech speech(language);
  Figures figure(speech);
  std::string out = opening(speech, language);
  out += "<p>" + speech("page.seconds", {{"seconds", speech.cell(summary["seconds"])}}) + "</p>\n";
  out += heading(speech, "felt") + pairs_table(speech, summary["percept"], "felt", kFelt);
  for (const char* plot : {"torque_over_distance", "contact_speed", "joint", "session"})
    out += figure(std::string(plot) + ".png", speech(std::string("plot.") + plot));
  out += heading(speech, "set") + grid_table(speech, summary["percept_sets"], "set", kPerceptSets);
  out += heading(speech, "reach") + grid_table(speech, summary["reaches"], "reach", kReaches);
  out += heading(speech, "alarm") + pairs_table(speech, summary["alarms"], "alarm", kAlarms);
  out += heading(speech, "lead") + pairs_table(speech, summary["lead_times"], "lead", kLeadTimes);
  out += heading(speech, "hit") + grid_table(speech, summary["hits"], "hit", kHits);
  out += heading(speech, "view") + views(speech, summary["views"], figure);
  const Json& audio = summary["audio"];
  out += heading(speech, "sound");
  out += audio.is_string() ? "<audio controls src=\"" + escaped(audio.get<std::string>()) + "\"></audio>\n"
                           : "<p>" + speech("value.none") + "</p>\n";
  out += heading(speech, "round_trip");
  out += summary["round_trip"].is_object()
             ? pairs_table(speech, summary["round_trip"], "round_trip", kRoundTrip)
             : "<p>" + speech("value.not_measured") + "</p>\n";
  out += heading(speech, "loop") + grid_table(speech, summary["loops"], "loop", kLoops);
  out += heading(speech, "deadline") + counts_table(speech, summary["deadline_missed"]);
  if (!summary["foreign_writers"].empty())
    out += heading(speech, "foreign_writer") +
           grid_table(speech, summary["foreign_writers"], "foreign_writer", kForeignWriters);
  out += heading(speech, "forgotten") + pairs_table(speech, summary["forgotten"], "forgotten", kForgotten);
  out += heading(speech, "workspace") + pairs_table(speech, summary["workspace"], "workspace", kWorkspace);
  if (const Json live = summary.value("live", Json()); live.is_object())
    out += heading(speech, "live") + pairs_table(speech, live, "live", kLive) +
           grid_table(speech, live["spreads"], "spread", kSpreads);
  out += heading(speech, "process") + grid_table(speech, summary["components"], "process", kProcesses);
  return out + "</main></body></html>\n";
}

}  // namespace phantom::phantom_session

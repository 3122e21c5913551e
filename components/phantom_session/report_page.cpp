#include "components/phantom_session/report_page.hpp"

#include <cstdio>
#include <nlohmann/json.hpp>

namespace phantom::phantom_session {
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

std::string cell(const Json& value) {
  if (value.is_null()) return "–";
  if (value.is_string()) return escaped(value.get<std::string>());
  if (value.is_boolean()) return value.get<bool>() ? "yes" : "no";
  if (value.is_number_float()) {
    char text[32];
    std::snprintf(text, sizeof text, "%.4g", value.get<double>());
    return text;
  }
  return escaped(value.dump());
}

std::string row(const std::vector<std::string>& cells, const char* tag = "td") {
  std::string out = "<tr>";
  for (const auto& text : cells) out += std::string("<") + tag + ">" + text + "</" + tag + ">";
  return out + "</tr>\n";
}

/// A member of summary.json and how the page shows it.
struct Field {
  const char *key, *words;
  double scale = 1.0;  // from the member's unit to the one in `words`
};
using Fields = std::vector<Field>;

std::string cell(const Json& object, const Field& field) {
  const Json value = object.value(field.key, Json());
  return cell(field.scale != 1.0 && value.is_number() ? Json(field.scale * value.get<double>()) : value);
}

// Returns a table of two columns: name and value.
std::string pairs_table(const Json& object, const Fields& fields) {
  std::string out = "<table>\n";
  for (const Field& field : fields) out += row({field.words, cell(object, field)});
  return out + "</table>\n";
}

// Returns a table with one row per entry of an array or object. An object's keys fill the first column,
// headed `names`.
std::string grid_table(const Json& entries, const Fields& fields, const char* names = "") {
  if (entries.empty()) return "<p>none</p>\n";
  std::vector<std::string> head;
  if (entries.is_object()) head.emplace_back(names);
  for (const Field& field : fields) head.emplace_back(field.words);
  std::string out = "<table>\n" + row(head, "th");
  for (const auto& [name, entry] : entries.items()) {
    std::vector<std::string> cells;
    if (entries.is_object()) cells.push_back(escaped(name));
    for (const Field& field : fields) cells.push_back(cell(entry, field));
    out += row(cells);
  }
  return out + "</table>\n";
}

// Returns a table with one row per topic.
std::string counts_table(const Json& counts) {
  std::string out = "<table>\n" + row({"Topic", "Deadlines missed"}, "th");
  for (const auto& [topic, count] : counts.items()) out += row({escaped(topic), cell(count)});
  return out + "</table>\n";
}

const Fields kPercept{
    {"onset_distance_m", "Clearance at which the drag was first felt (median of the reaches), mm", 1e3},
    {"peak_torque_nm", "Greatest percept torque, N·m"},
    {"contact_speed_with", "Speed at first contact with the percept (median), mm/s", 1e3},
    {"contact_speed_without", "Speed at first contact without the percept (median), mm/s", 1e3}};
const Fields kPerceptSets{{"t", "From, s"},
                          {"set", "Row of Table 6.1, and the percepts chosen"},
                          {"automatic", "Chosen by the law"}};
const Fields kReaches{{"n", "Reach"},
                      {"t", "Begins at, s"},
                      {"percept", "Percept"},
                      {"onset_distance_m", "Drag felt from, mm", 1e3},
                      {"peak_torque_nm", "Greatest percept torque, N·m"},
                      {"contact_t", "Contact at, s"},
                      {"contact_speed_m_s", "Speed at contact, mm/s", 1e3},
                      {"object", "Object"}};
const Fields kHits{{"t", "Time, s"},
                   {"alert", "Alert"},
                   {"link", "Place on the arm"},
                   {"object", "Object"},
                   {"rule", "Why"}};
const Fields kRoundTrip{{"p50_us", "Median, ms", 1e-3},
                        {"p99_us", "99 % are below, ms", 1e-3},
                        {"p999_us", "99.9 % are below, ms", 1e-3},
                        {"max_us", "Longest, ms", 1e-3},
                        {"n", "Measured round trips"}};
const Fields kLoops{{"rate_hz", "Rate of the last second, Hz"},
                    {"nominal_hz", "Nominal, Hz"},
                    {"p50_us", "Late: median, µs"},
                    {"p99_us", "99 % are below, µs"},
                    {"max_us", "at most, µs"},
                    {"work_p50_us", "Work of a period: median, µs"},
                    {"ticks", "Periods"},
                    {"slips", "Periods missed"}};
const Fields kWorkspace{{"version", "Version"},
                        {"bricks", "Bricks"},
                        {"bytes", "Size, MB", 1e-6},
                        {"build_seconds", "Time to build it, s"}};
const Fields kForgotten{{"components", "Components"}, {"reaches", "Reaches"}, {"hits", "Hits"}};
const Fields kProcesses{{"exit", "Exit code"}, {"restarts", "Restarts"}};

/// Numbers the page's figures in their order.
class Figures {
 public:
  std::string operator()(const std::string& file, const std::string& caption) {
    const std::string text = "Figure " + std::to_string(++number_) + ". " + escaped(caption);
    return "<figure><img src=\"" + escaped(file) + "\" alt=\"" + text + "\"><figcaption>" + text +
           "</figcaption></figure>\n";
  }

 private:
  int number_ = 0;
};

constexpr const char* kHead = R"(<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>Phantom session report</title>
<style>
body{font:15px/1.5 system-ui,sans-serif;max-width:1100px;margin:2em auto;padding:0 1em;color:#222}
table{border-collapse:collapse;margin:.5em 0 1.5em}td,th{border:1px solid #ccc;padding:.2em .7em;text-align:left}
th{background:#f2f2f2}figure{margin:1em 0}img{max-width:100%;border:1px solid #ddd}figcaption{color:#555}
@media print{figure{break-inside:avoid}}
</style></head><body>
<h1>Phantom session report</h1>
)";

}  // namespace

std::string report_page(const std::string& summary_json) {
  const Json summary = Json::parse(summary_json);
  Figures figure;
  std::string out = kHead;
  out += "<p>" + cell(summary["seconds"]) + " s with all components running.</p>\n";
  out += "<h2>What the operator felt</h2>\n" + pairs_table(summary["percept"], kPercept);
  out += figure("torque_over_distance.png",
                "Percept torque over the distance to the nearest object, on the way in, "
                "in the reaches with the percept; the greatest over the joints (of a sliding joint, "
                "the force in N).");
  out += figure("contact_speed.png", "Speed of the tool at the first contact of each reach.");
  out += figure("joint.png",
                "The joint that felt most: positions of master and slave, torque of the hand, "
                "and the torques that percept and slave feedback exert on it.");
  out += figure(
      "session.png",
      "The session over time: clearance to the nearest object, torques on the hand (of a sliding joint, "
      "forces in N), speed of the tool, contact force.");
  out += "<h2>Law, counterbalancing and percepts</h2>\n" + grid_table(summary["percept_sets"], kPerceptSets);
  out += "<h2>Reaches</h2>\n" + grid_table(summary["reaches"], kReaches);
  out += "<h2>Hits that threatened</h2>\n" + grid_table(summary["hits"], kHits);
  out += "<h2>Views</h2>\n";
  for (const auto& view : summary["views"]) {
    if (!view.contains("png")) continue;
    std::string caption = "The zone of alert " + cell(view.value("alert", Json()));
    caption +=
        " at " + cell(view.value("t", Json())) + " s, seen from node " + cell(view.value("node", Json()));
    out += figure(view["png"].get<std::string>(), caption + ".");
  }
  out += "<h2>Sound</h2>\n";
  out += summary["audio"].is_string()
             ? "<audio controls src=\"" + escaped(summary["audio"].get<std::string>()) + "\"></audio>\n"
             : "<p>none</p>\n";
  out += "<h2>Round trip from master over slave and phantom back to the master</h2>\n";
  out += summary["round_trip"].is_object() ? pairs_table(summary["round_trip"], kRoundTrip)
                                           : "<p>not measured</p>\n";
  out += "<h2>Loops</h2>\n" + grid_table(summary["loops"], kLoops, "Process and loop");
  out += "<h2>Deadlines missed</h2>\n" + counts_table(summary["deadline_missed"]);
  out +=
      "<h2>In none of these figures, as too many came</h2>\n" + pairs_table(summary["forgotten"], kForgotten);
  out += "<h2>Workspace</h2>\n" + pairs_table(summary["workspace"], kWorkspace);
  out += "<h2>Processes</h2>\n" + grid_table(summary["components"], kProcesses, "Process");
  return out + "</body></html>\n";
}

}  // namespace phantom::phantom_session

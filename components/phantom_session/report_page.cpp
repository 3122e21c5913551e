#include "components/phantom_session/report_page.hpp"

#include <cstdio>
#include <nlohmann/json.hpp>

namespace phantom::phantom_session {
namespace {

using Json = nlohmann::ordered_json;

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '&':
        out += "&amp;";
        break;
      case '"':
        out += "&quot;";
        break;
      default:
        out += c;
    }
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

// Two columns: name and value.
std::string pairs_table(const Json& object) {
  std::string out = "<table>\n";
  for (const auto& [key, value] : object.items()) out += row({escaped(key), cell(value)});
  return out + "</table>\n";
}

// One line per entry of an array (or named entry of an object), one column per member of the first.
std::string grid_table(const Json& entries) {
  if (entries.empty()) return "<p>none</p>\n";
  const bool named = entries.is_object();
  std::vector<std::string> head;
  if (named) head.push_back("");
  for (const auto& [key, value] : entries.begin()->items()) head.push_back(escaped(key));
  std::string out = "<table>\n" + row(head, "th");
  for (const auto& [name, entry] : entries.items()) {
    std::vector<std::string> cells;
    if (named) cells.push_back(escaped(name));
    for (const auto& [key, value] : entry.items()) cells.push_back(cell(value));
    out += row(cells);
  }
  return out + "</table>\n";
}

std::string figure(const std::string& file, const std::string& caption) {
  return "<figure><img src=\"" + escaped(file) + "\" alt=\"" + escaped(caption) + "\"><figcaption>" +
         escaped(caption) + "</figcaption></figure>\n";
}

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
  std::string out = kHead;
  out += "<p>" + cell(summary["seconds"]) + " s with all components running.</p>\n";
  out += "<h2>What the operator felt</h2>\n" + pairs_table(summary["percept"]);
  out += figure("torque_over_distance.png",
                "Percept torque against the distance to the nearest object, on the way in");
  out += figure("contact_speed.png", "Speed of the tool at first contact, with and without the percept");
  out += figure("joint.png",
                "The joint that felt most: where master and slave stand, "
                "and the torques on the hand under the bilateral law");
  out += figure("session.png", "The session: clearance, torque, speed and contact force over time");
  out += "<h2>Reaches</h2>\n" + grid_table(summary["reaches"]);
  out += "<h2>Hits that threatened</h2>\n" + grid_table(summary["hits"]);
  out += "<h2>Views</h2>\n";
  for (const auto& view : summary["views"]) {
    if (view.contains("png"))
      out += figure(view["png"].get<std::string>(), "view from node " + cell(view.value("node", Json())));
  }
  out += "<h2>Sound</h2>\n";
  out += summary["audio"].is_string()
             ? "<audio controls src=\"" + escaped(summary["audio"].get<std::string>()) + "\"></audio>\n"
             : "<p>none</p>\n";
  out += "<h2>Haptic path</h2>\n";
  if (summary["round_trip"].is_object()) out += pairs_table(summary["round_trip"]);
  out += grid_table(summary["loops"]);
  out += "<h2>Deadlines missed, by topic</h2>\n" + pairs_table(summary["deadline_missed"]);
  out += "<h2>Workspace</h2>\n" + pairs_table(summary["workspace"]);
  out += "<h2>Processes</h2>\n" + grid_table(summary["components"]);
  return out + "</body></html>\n";
}

}  // namespace phantom::phantom_session

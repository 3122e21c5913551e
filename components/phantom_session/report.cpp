#include "components/phantom_session/report.hpp"

#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>

#include "common/runtime/process/process.hpp"
#include "components/phantom_session/report_page.hpp"

namespace phantom::phantom_session {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kPlotLimit_s = 60.0;

// Returns the file that `component` left in the folder, or null if there is none that can be read.
Json component_file(const std::filesystem::path& folder, const std::string& component) {
  std::ifstream file(folder / (component + ".json"));
  if (!file) return nullptr;
  Json content = Json::parse(file, nullptr, false);
  if (content.is_discarded()) {
    spdlog::warn("{}.json in the report folder is not JSON; left out of the summary", component);
    return nullptr;
  }
  return content;
}

Json member(const Json& object, const char* key) {
  return object.is_object() && object.contains(key) ? object[key] : Json();
}

Json median(std::vector<double> values) {
  if (values.empty()) return nullptr;
  std::sort(values.begin(), values.end());
  const std::size_t middle = values.size() / 2;
  return values.size() % 2 == 1 ? values[middle] : 0.5 * (values[middle - 1] + values[middle]);
}

Json processes_json(const std::vector<ProcessOutcome>& processes) {
  Json out = Json::object();
  for (const auto& process : processes) {
    out[process.name] = {{"exit", process.exit_code ? Json(*process.exit_code) : Json()}, {"restarts", 0}};
  }
  return out;
}

Json loops_json(const Collector& collector) {
  Json out = Json::object();
  for (const auto& [component, status] : collector.statuses()) {
    for (const auto& loop : status.loops) {
      out[component + "." + loop.name] = {{"rate_hz", loop.rate_hz},      {"nominal_hz", 1.0 / loop.period_s},
                                          {"p50_us", loop.wakeup_p50_us}, {"p99_us", loop.wakeup_p99_us},
                                          {"max_us", loop.wakeup_max_us}, {"work_p50_us", loop.work_p50_us},
                                          {"ticks", loop.ticks},          {"slips", loop.slips}};
    }
  }
  return out;
}

Json deadlines_json(const Collector& collector) {
  Json out = Json::object();
  for (const auto& [component, status] : collector.statuses()) {
    for (const auto& [topic, missed] : status.deadline_missed)
      out[topic] = out.value(topic, std::uint64_t{0}) + missed;
  }
  return out;
}

// Returns the objects that were touched both with and without the percept: only these can be compared.
std::set<int> compared_objects(const Collector& collector) {
  std::set<int> with, without, both;
  for (const Reach& reach : collector.reaches()) {
    if (reach.contact_s && !reach.percept_missing)
      (reach.percept ? with : without).insert(reach.contact_object);
  }
  std::set_intersection(with.begin(), with.end(), without.begin(), without.end(),
                        std::inserter(both, both.end()));
  return both;
}

Json percept_json(const Collector& collector) {
  const std::set<int> compared = compared_objects(collector);
  std::vector<double> onsets, with, without;
  double peak_Nm = 0.0;
  for (const Reach& reach : collector.reaches()) {
    peak_Nm = std::max(peak_Nm, reach.peak_torque_Nm);
    if (reach.onset_distance_m) onsets.push_back(*reach.onset_distance_m);
    if (reach.contact_s && !reach.percept_missing && compared.contains(reach.contact_object)) {
      (reach.percept ? with : without).push_back(reach.contact_speed_m_s);
    }
  }
  return {{"onset_distance_m", median(onsets)},
          {"peak_torque_nm", peak_Nm},
          {"contact_speed_with", median(with)},
          {"contact_speed_without", median(without)}};
}

// Returns the time from the first alert of the object that a reach touches until it does; none: nothing was
// touched, or no alert came before.
std::optional<double> lead_s(const Reach& reach, const Collector& collector) {
  if (!reach.contact_s) return std::nullopt;
  for (const HitSample& hit : collector.hits())
    if (hit.object == reach.contact_object && hit.t_s >= reach.start_s && hit.t_s <= *reach.contact_s)
      return *reach.contact_s - hit.t_s;
  return std::nullopt;
}

// How long before the contacts the alerts came.
Json lead_times_json(const Collector& collector) {
  constexpr double kReaction_s = 0.3;  // of a person: 0.2 to 0.5 s
  std::vector<double> leads;
  std::size_t contacts = 0;
  for (const Reach& reach : collector.reaches()) {
    if (!reach.contact_s || reach.percept_missing) continue;
    ++contacts;
    if (const auto lead = lead_s(reach, collector)) leads.push_back(*lead);
  }
  const auto in_time = std::ranges::count_if(leads, [](double lead) { return lead >= kReaction_s; });
  return {{"contacts", contacts},
          {"unannounced", contacts - leads.size()},
          {"median_s", median(leads)},
          {"least_s", leads.empty() ? Json() : Json(std::ranges::min(leads))},
          {"share_in_time",
           contacts == 0 ? Json() : Json(static_cast<double>(in_time) / static_cast<double>(contacts))}};
}

Json reaches_json(const Collector& collector) {
  Json out = Json::array();
  for (const Reach& reach : collector.reaches()) {
    out.push_back({{"n", reach.number},
                   {"t", reach.start_s},
                   {"percept", reach.percept},
                   {"percept_missing", reach.percept_missing},
                   {"onset_distance_m", reach.onset_distance_m ? Json(*reach.onset_distance_m) : Json()},
                   {"peak_torque_nm", reach.peak_torque_Nm},
                   {"contact_t", reach.contact_s ? Json(*reach.contact_s) : Json()},
                   {"contact_speed_m_s", reach.contact_s ? Json(reach.contact_speed_m_s) : Json()},
                   {"object", reach.contact_s ? Json(collector.object_name(reach.contact_object)) : Json()},
                   {"lead_s", lead_s(reach, collector) ? Json(*lead_s(reach, collector)) : Json()},
                   {"alarms", reach.alarms}});
  }
  return out;
}

Json hits_json(const Collector& collector) {
  Json out = Json::array();
  for (const HitSample& hit : collector.hits()) {
    out.push_back({{"t", hit.t_s},
                   {"alert", hit.alert},
                   {"link", hit.place()},
                   {"object", collector.object_name(hit.object)},
                   {"rule", hit.rule}});
  }
  return out;
}

Json alarms_json(const Collector& collector) {
  std::size_t most = 0;
  for (const Reach& reach : collector.reaches()) most = std::max(most, reach.alarms);
  return {{"entries", collector.alarms().entries()},
          {"most_in_a_reach", most},
          {"alerts", collector.hits().size() + collector.forgotten().hits}};
}

Json percept_sets_json(const Collector& collector) {
  Json out = Json::array();
  for (const PerceptPeriod& period : collector.percept_periods()) {
    out.push_back({{"t", period.t_s},
                   {"set", period.percepts.words()},
                   {"automatic", period.percepts.choice.automatic}});
  }
  return out;
}

Json foreign_writers_json(const Collector& collector) {
  Json out = Json::array();
  for (const ForeignWriter& each : collector.foreign_writers())
    out.push_back(
        {{"t", each.t_s}, {"topic", each.topic}, {"process", each.process}, {"samples", each.samples}});
  return out;
}

Json forgotten_json(const Collector::Forgotten& forgotten) {
  return {{"components", forgotten.components}, {"reaches", forgotten.reaches}, {"hits", forgotten.hits}};
}

// Returns the viewer's pictures with their times converted to the session's.
Json views_json(const Json& viewer, std::int64_t start_utc_ns) {
  Json views = member(viewer, "views");
  if (!views.is_array()) return Json::array();
  for (auto& view : views) {
    const Json utc_ns = member(view, "utc_ns");
    if (utc_ns.is_number_integer()) view["t"] = core::seconds(utc_ns.get<std::int64_t>() - start_utc_ns);
  }
  return views;
}

// Returns the distributions of live matter; null if there is none.
Json live_json(const Json& server, const Json& camera) {
  const Json live = member(server, "live");
  if (!live.is_object()) return nullptr;
  return {{"versions", member(live, "versions")},
          {"most_voxels", member(live, "most_voxels")},
          {"images", member(camera, "images")},
          {"spreads",
           {{"image → workspace [ms]", member(live, "image_to_version_ms")},
            {"image → occupancy_change [ms]", member(camera, "image_to_change_ms")},
            {"fusion of an image [ms]", member(camera, "fuse_ms")},
            {"update of the workspace [ms]", member(live, "update_ms")},
            {"bricks changed by a version", member(live, "bricks_changed")},
            {"blocks changed by an image", member(camera, "blocks_changed")}}}};
}

Json summary(const ReportInputs& in) {
  const Json master = component_file(in.folder, "master_io");
  const Json viewer = component_file(in.folder, "synthetic_viewer");
  const Json audio = component_file(in.folder, "audio_percept");
  const Json server = component_file(in.folder, "wva_server");
  Json workspace = Json::object();
  for (const char* key : {"version", "bricks", "bytes", "build_seconds"})
    workspace[key] = member(server, key);
  return {{"seconds", in.seconds},
          {"page", in.page},
          {"components", processes_json(in.processes)},
          {"loops", loops_json(in.collector)},
          {"round_trip", member(master, "round_trip")},
          {"deadline_missed", deadlines_json(in.collector)},
          {"percept", percept_json(in.collector)},
          {"percept_sets", percept_sets_json(in.collector)},
          {"reaches", reaches_json(in.collector)},
          {"alarms", alarms_json(in.collector)},
          {"lead_times", lead_times_json(in.collector)},
          {"hits", hits_json(in.collector)},
          {"foreign_writers", foreign_writers_json(in.collector)},
          {"forgotten", forgotten_json(in.collector.forgotten())},
          {"views", views_json(viewer, in.start_utc_ns)},
          {"audio", member(audio, "wav")},
          {"workspace", workspace},
          {"live", live_json(server, component_file(in.folder, "workspace_camera"))}};
}

std::ofstream open_file(const std::filesystem::path& path) {
  std::ofstream file(path);
  if (!file) throw std::runtime_error(path.string() + ": cannot be written");
  return file;
}

void write_series(const std::filesystem::path& folder, const Collector& collector) {
  std::map<int, const Reach*> reaches;
  for (const Reach& reach : collector.reaches()) reaches[reach.number] = &reach;
  auto file = open_file(folder / "series.csv");
  file << "t_s,reach,percept_enabled,approaching,clearance_m,percept_torque_Nm,feedback_torque_Nm,"
          "operator_torque_Nm,mu_Pa_s_per_m,closeness,tool_speed_m_s,contact_force_N\n";
  for (const Row& row : collector.rows()) {
    const auto found = reaches.find(row.reach);
    // An approach lasts until the first contact of the reach.
    const bool approaching =
        found != reaches.end() && (!found->second->contact_s || row.t_s < *found->second->contact_s);
    file << row.t_s << ',' << row.reach << ',' << row.percept_enabled << ',' << approaching << ','
         << row.clearance_m << ',' << row.percept_torque_Nm << ',' << row.feedback_torque_Nm << ','
         << row.operator_torque_Nm << ',' << row.mu_Pa_s_per_m << ',' << row.closeness << ','
         << row.tool_speed_m_s << ',' << row.contact_force_N << '\n';
  }
}

void write_reaches(const std::filesystem::path& folder, const Collector& collector) {
  auto file = open_file(folder / "reaches.csv");
  file << "reach,percept,object,contact_speed_m_s,onset_distance_m,peak_torque_Nm\n";
  for (const Reach& reach : collector.reaches()) {
    if (!reach.contact_s) continue;
    file << reach.number << ',' << reach.percept << ',' << collector.object_name(reach.contact_object) << ','
         << reach.contact_speed_m_s << ',' << reach.onset_distance_m.value_or(NAN) << ','
         << reach.peak_torque_Nm << '\n';
  }
}

}  // namespace

std::string summary_json(const ReportInputs& inputs) { return summary(inputs).dump(2) + "\n"; }

void write_report(const ReportInputs& inputs) {
  write_series(inputs.folder, inputs.collector);
  write_reaches(inputs.folder, inputs.collector);
  const std::string text = summary_json(inputs);
  open_file(inputs.folder / "summary.json") << text;
  for (const Language language : kLanguages)
    open_file(inputs.folder / report_file(language)) << report_page(text, language);
}

namespace {

// Returns the variables for report.gp: which reaches and which joint to draw, and their names.
std::string plot_variables(const std::filesystem::path& folder, const Collector& collector,
                           const JointLog& joints, const std::optional<robot::SerialArm>& arm) {
  std::string reaches, objects;
  bool contacts = false;
  for (const Reach& reach : collector.reaches()) {
    contacts = contacts || reach.contact_s;
    const bool drawn =
        reach.percept && std::any_of(collector.rows().begin(), collector.rows().end(), [&](const Row& row) {
          return row.reach == reach.number && row.clearance_m >= 0.0 && row.percept_enabled;
        });
    if (!drawn) continue;
    reaches += std::to_string(reach.number) + " ";
    objects += (reach.contact_s ? collector.object_name(reach.contact_object) : "no_contact") + " ";
  }
  std::string words = "folder='" + folder.string() + "'; reaches='" + reaches + "'; objects='" + objects +
                      "'; contacts=" + (contacts ? "1" : "0");
  const auto joint = joints.most_telling();
  words += "; joint=" + std::to_string(joint ? *joint + 1 : 0) + "; law='" +
           (joints.rows().empty() ? "" : joints.rows().back().law) + "'";
  const bool known = joint && arm && *joint < arm->joint_count();
  const bool slides = known && arm->joints()[*joint].type == robot::JointType::kPrismatic;
  words += "; joint_name='" +
           (known ? arm->joints()[*joint].name : "joint " + std::to_string(joint ? *joint + 1 : 0));
  words += slides ? "'; position='Position [m]'; effort='Force [N]'"
                  : "'; position='Angle [rad]'; effort='Torque [N·m]'";
  return words;
}

}  // namespace

bool draw_plots(const std::filesystem::path& folder, const Collector& collector, const JointLog& joints,
                const std::optional<robot::SerialArm>& arm) {
  const std::filesystem::path gnuplot = "/usr/bin/gnuplot";
  if (access(gnuplot.c_str(), X_OK) != 0) {
    spdlog::warn("gnuplot is not installed: the report has its CSV files but no plots");
    return false;
  }
  Supervisor drawing;
  drawing.start({"gnuplot",
                 gnuplot,
                 {"-e", plot_variables(folder, collector, joints, arm),
                  runtime::share_path("config/report.gp").string()},
                 0,
                 folder / "logs" / "gnuplot.log"});
  const auto end = core::monotonic_ns() + core::from_seconds(kPlotLimit_s);
  while (core::monotonic_ns() < end) {
    const auto ended = drawing.newly_dead();
    if (!ended.empty()) return ended.front().exit_code == 0;
    usleep(20'000);
  }
  return false;
}

}  // namespace phantom::phantom_session

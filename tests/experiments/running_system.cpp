// The swing to the bar once more, made by the executables as they are shipped: a session of a topology whose
// samples dds_recorder records, so that what crossed the network is held against the law (thesis 5.3.1, case
// a).

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "tests/experiments/arms/bar_rig.hpp"
#include "tests/experiments/rig.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/own_domain.hpp"

namespace phantom::experiments {
namespace in_running_system {
namespace {

using test::replaced;

constexpr double kEnd_deg = 44.0, kSpeed_deg_s = 8.0, kRampShare = 0.1, kGain = 20.0;
constexpr double kFrom_deg = 6.0, kTo_deg = 38.0;  // where the feedback is compared, without start and stop
constexpr double kBin_deg = 0.5;
constexpr std::size_t kBins = 64;
constexpr std::size_t kMinInBin = 10;

/// Cell, arm and parameters of the swing, from the shipped ones: the bar stands in the model only ("no object
/// is placed in workspace to avoid robot damage"), the skin is that of the link under test.
std::filesystem::path write_deployment(const std::filesystem::path& folder, const Settings& settings) {
  const auto source = [&](const char* file) { return test::read_text(settings.source_dir / file); };
  const auto write = [&](const char* name, const std::string& text) { std::ofstream(folder / name) << text; };
  write("cell.yaml", replaced(test::read_text(write_bar_cell(folder, settings)), "    pose: {",
                              "    real_deviation: {xyz_m: [10, 0, 0]}\n    pose: {"));
  write("reaches.yaml", "reaches:\n  - {name: theta to the bar, object: bar, from: [0, 0, 0], target: [0, " +
                            std::to_string(rad(kEnd_deg)) + ", 0]}\n");
  std::string master = source("components/master_io/master_io.yaml");
  for (const auto& [from, to] : std::vector<std::pair<std::string, std::string>>{
           {"  percept: alternate ", "  percept: on "},
           {"  in_s: 3 ", "  in_s: " + std::to_string(kEnd_deg / kSpeed_deg_s / (1.0 - kRampShare)) + " "},
           {"  overreach: 0.06", "  overreach: 0"},
           {"  duration_scatter: 0.05", "  duration_scatter: 0"},
           {"    ramp_share: 0.1 ", "    ramp_share: " + std::to_string(kRampShare) + " "},
           {"  gain: 20 ", "  gain: " + std::to_string(kGain) + " "}})
    master = replaced(master, from, to);
  write("master_io.yaml", master);
  write("topology.yaml",
        "name: swing\ndomain: " + std::to_string(test::own_domain()) +
            "\nqos_profiles: " + (settings.source_dir / "deploy/qos/phantom.xml").string() +
            "\ncell: cell.yaml\nnetwork: {interfaces: [127.0.0.1]}\nhosts:\n  - name: desk\n    processes:\n"
            "      - {component: wva_server}\n      - {component: slave_io, simulation: true}\n"
            "      - {component: phantom_sensing}\n"
            "      - {component: dds_recorder, arguments: [record, --folder, \"" +
            (folder / "recordings").string() +
            "\"]}\n      - {component: master_io, config: master_io.yaml, simulation: true}\n");
  return folder / "topology.yaml";
}

/// Runs a shipped executable to its end; its exit code and what it said.
std::pair<int, std::string> run_shipped(const Settings& settings, const std::filesystem::path& log,
                                        std::vector<std::string> words) {
  words.front() = (settings.bin_dir / words.front()).string();
  test::Process process(words, log);
  const int code = process.wait();
  return {code, process.output()};
}

/// One tick of the master, with the slave's angle from which its drag coefficients came.
struct Tick {
  double theta_rad = 0.0, speed_rad_s = 0.0, pffb_Nm = 0.0, gain = 0.0;
  bool coupled = false, limited = false;
};

/// What the recording tells, topic by topic, joined by the echoes that the samples carry.
std::vector<Tick> ticks_of(const std::filesystem::path& lines) {
  std::map<std::uint64_t, double> theta_rad;         // by number of slave_state
  std::map<std::uint64_t, std::uint64_t> sensed_at;  // slave_state that a drag_field came from
  std::vector<nlohmann::json> masters;
  std::ifstream stream(lines);
  for (std::string line; std::getline(stream, line);) {
    const auto message = nlohmann::json::parse(line);
    const auto& sample = message.at("sample");
    const std::uint64_t number = sample.at("stamp").at("sequence_number");
    if (message.at("topic") == "slave_state") theta_rad[number] = sample.at("position_rad").at(kTheta);
    if (message.at("topic") == "drag_field" && sample.at("valid").get<bool>())
      sensed_at[number] = sample.at("slave_echo").at("sequence_number");
    if (message.at("topic") == "master_state") masters.push_back(sample);
  }
  std::vector<Tick> ticks;
  for (const auto& master : masters) {
    const auto field = sensed_at.find(master.at("drag_echo").at("sequence_number"));
    const auto slave = field == sensed_at.end() ? theta_rad.end() : theta_rad.find(field->second);
    if (slave == theta_rad.end()) continue;
    ticks.push_back({slave->second, master.at("velocity_rad_s").at(kTheta),
                     -master.at("percept_torque_Nm").at(kTheta).get<double>(), master.at("percept_gain"),
                     master.at("state") == "LINK_COUPLED", master.at("percept_limited")});
  }
  return ticks;
}

double median_of(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// The drag on the hand over its speed and the gain, in bins of the way in: what the samples say of the
/// coefficient of drag. A bin's median: a host that is late now and then spoils some of its samples.
struct Measured {
  std::vector<double> theta_deg, coefficient;
  double first_deg = INFINITY, greatest_power_W = -INFINITY;
  std::size_t fewest = 0;
};

Measured measured_of(const std::vector<Tick>& ticks) {
  Measured measured;
  std::array<std::vector<double>, kBins> found;
  for (const Tick& tick : ticks) {
    measured.greatest_power_W = std::max(measured.greatest_power_W, -tick.pffb_Nm * tick.speed_rad_s);
    const bool steady = tick.coupled && !tick.limited && tick.speed_rad_s > rad(0.5 * kSpeed_deg_s);
    if (!steady) continue;
    if (tick.pffb_Nm > 1e-6) measured.first_deg = std::min(measured.first_deg, degrees(tick.theta_rad));
    const double bin = (degrees(tick.theta_rad) - kFrom_deg) / kBin_deg;
    if (bin < 0.0 || bin >= static_cast<double>(kBins)) continue;
    found[static_cast<std::size_t>(bin)].push_back(tick.pffb_Nm / (tick.gain * tick.speed_rad_s));
  }
  measured.fewest = found.front().size();
  for (std::size_t i = 0; i < kBins; ++i) {
    measured.fewest = std::min(measured.fewest, found[i].size());
    if (found[i].empty()) continue;
    measured.theta_deg.push_back(kFrom_deg + (static_cast<double>(i) + 0.5) * kBin_deg);
    measured.coefficient.push_back(median_of(found[i]));
  }
  return measured;
}

void run(Report& report, const Settings& settings) {
  const auto folder = std::filesystem::absolute(report.folder());
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  const std::string topology = write_deployment(folder, settings).string();
  const auto [session_code, session_output] = run_shipped(
      settings, folder / "session.log",
      {"phantom_session", "--deployment", topology, "--seconds", settings.fast ? "14" : "36", "--operator",
       "constant_velocity", "--law", "pf", "--report-dir", (folder / "report").string()});
  if (session_code != 0) throw std::runtime_error("phantom_session: " + session_output);
  const auto recordings = (folder / "recordings").string(), lines = (folder / "samples.jsonl").string();
  const auto [checked, check_output] =
      run_shipped(settings, folder / "check.log", {"dds_recorder", "check", recordings});
  const auto [converted, convert_output] =
      run_shipped(settings, folder / "convert.log",
                  {"dds_recorder", "convert", recordings, "--out", lines, "--topics", "master_state",
                   "slave_state", "drag_field"});
  if (converted != 0) throw std::runtime_error("dds_recorder: " + convert_output);
  const auto ticks = ticks_of(lines);
  const Measured measured = measured_of(ticks);

  const auto cell = bar_cell({.source_dir = settings.source_dir});  // with the physics as it is
  const auto& profile = cell.objects.front().profile;
  double onset_deg = 0.0, square = 0.0, ideal_square = 0.0;
  while (ideal_coefficient(profile, cell.voxel_size_m.reference_m(), rad(onset_deg)) == 0.0)
    onset_deg += 0.01;
  Table& table = report.table("coefficient", {"θ [°]", "recorded [N·m·s/rad]", "law [N·m·s/rad]"});
  for (std::size_t i = 0; i < measured.theta_deg.size(); ++i) {
    const double ideal =
        ideal_coefficient(profile, cell.voxel_size_m.reference_m(), rad(measured.theta_deg[i]));
    table.row({measured.theta_deg[i], measured.coefficient[i], ideal});
    square += std::pow(measured.coefficient[i] - ideal, 2);
    ideal_square += ideal * ideal;
  }
  report
      .plot("coefficient",
            "Drag on the hand while θ swings to the bar at 8 °/s, recorded from the running processes\n"
            "six layers of 4 cm with μ = 32, 20, 13, 11, 10, 8 Pa·s/m, 60 sensors along the link")
      .panel("", "angle θ of the slave [°]", "drag coefficient of θ [N·m·s/rad]")
      .series(table, "θ [°]", "recorded [N·m·s/rad]", "feedback ÷ (gain × speed), from DDS", Style::kPoints)
      .series(table, "θ [°]", "law [N·m·s/rad]", "the law: ∫ μ r² along the link, without voxels");

  // As in pffb-speed: what the libraries reach on a simulated clock, the processes reach over the network.
  report.check("rms deviation of the recorded coefficient from ∫ μ r², share of its rms",
               std::sqrt(square / ideal_square), 0.0, 0.05, "");
  report.check("onset: deviation from the outermost layer by geometry", measured.first_deg - onset_deg, -0.8,
               0.8, "°");
  report.check("greatest power of the drag on the hand: it never pushes", measured.greatest_power_W,
               -INFINITY, 1e-9, "W");
  report.check("ticks of the way in, fewest in half a degree", static_cast<double>(measured.fewest),
               static_cast<double>(kMinInBin), INFINITY, "");
  report.check("exit code of dds_recorder check", checked, 0, 0, "");
  report.prints_no_more(
      "figure 5.24 (page 149) prints the clamp alone, which pffb-speed judges; the swing here stays below it.");
  report.difference(
      "The thesis shows the swing on its rig; ours is made by wva_server, slave_io, "
      "phantom_sensing and master_io as they are shipped, with simulated drives, "
      "and taken from what dds_recorder wrote. The samples are joined by the echoes that they carry.");
}

}  // namespace
}  // namespace in_running_system

Experiment running_system() {
  return {"running-system",
          "The swing to the bar, made by the running processes",
          "figure 5.24, section 5.3.1",
          "The feedback on the master is the drag of the slave's pose times the master's own speed, "
          "sets in where the outermost layer begins, and never pushes.",
          {Sabotage::kConstantMu, Sabotage::kLayersOffByOne},
          in_running_system::run};
}

}  // namespace phantom::experiments

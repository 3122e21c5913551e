// A probe that goes into a pool and moves in its currents (thesis 7.3(5)): `phantom_sensing probe` as it is
// shipped, in the shipped pool, against areas and speeds worked out by hand.

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <map>
#include <numbers>
#include <random>
#include <sstream>

#include "tests/experiments/arms/simulated_rig.hpp"
#include "tests/experiments/rig.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/files.hpp"

namespace phantom::experiments {
namespace in_submerged {
namespace {

constexpr std::size_t kJoints = 5;
using Five = std::array<double, kJoints>;

// The pool_bench's cell in figures: m, Pa·s/m, m/s.
constexpr double kSurface_m = 0.55, kWater = 2.0, kDrift_m_s = 0.05;
constexpr double kJetBottom_m = 0.25, kJetTop_m = 0.50, kJet_m_s = 0.15;
constexpr double kMount_m = 0.45;  // height of the crane's base

struct Pose {
  Five q{}, v{};
};

/// What the probe wrote of one pose.
struct Row {
  Five torque{}, coefficient{}, drift{};
};

/// A part of the arm's skin: a tube around the vertical.
struct Tube {
  double radius_m, bottom_m, top_m;  // from the column's origin

  double area_m2(double origin_m, double from_m, double to_m) const {
    const double low = std::max(origin_m + bottom_m, from_m), high = std::min(origin_m + top_m, to_m);
    return 2.0 * std::numbers::pi * radius_m * std::max(0.0, high - low);
  }
};
constexpr std::array<Tube, 3> kSkin{
    {{0.03, 0.02, 0.45}, {0.03, -0.09, 0.0}, {0.008, -0.26, -0.10}}};  // column, head, probe

/// Area of the skin between two heights with the third joint at q3.
double area_m2(double q3, double from_m, double to_m) {
  double sum = 0.0;
  for (const Tube& tube : kSkin) sum += tube.area_m2(kMount_m + q3, from_m, to_m);
  return sum;
}

/// Senses poses with the shipped executable.
std::vector<Row> probe(const Settings& settings, const std::filesystem::path& cell,
                       const std::filesystem::path& files, const std::vector<Pose>& poses,
                       const std::string& mode = "separable") {
  const auto file = [&](const char* ending) { return files.string() + ending; };
  {
    std::ofstream csv(file("_poses.csv"));
    csv.precision(17);
    csv << "t,q1,q2,q3,q4,q5,v1,v2,v3,v4,v5\n";
    for (std::size_t i = 0; i < poses.size(); ++i) {
      csv << 0.01 * static_cast<double>(i);
      for (const double q : poses[i].q) csv << ',' << q;
      for (const double v : poses[i].v) csv << ',' << sabotaged(v, settings.sabotage);
      csv << '\n';
    }
  }
  const std::vector<std::string> words{(settings.bin_dir / "phantom_sensing").string(),
                                       "probe",
                                       "--cell",
                                       cell.string(),
                                       "--joints",
                                       file("_poses.csv"),
                                       "--mode",
                                       mode,
                                       "--out",
                                       file(".csv")};
  test::Process process(words, file(".log"));
  if (process.wait() != 0)
    throw std::runtime_error("phantom_sensing probe: " + test::read_text(file(".log")));
  std::istringstream csv(test::read_text(file(".csv")));
  std::string line;
  std::getline(csv, line);
  const bool has_drift = line.find("drift1") != std::string::npos;
  std::vector<Row> rows;
  while (std::getline(csv, line)) {
    std::istringstream cells(line);
    std::vector<double> values;
    for (std::string cell_text; values.size() < 16 && std::getline(cells, cell_text, ',');)
      values.push_back(std::stod(cell_text));
    Row& row = rows.emplace_back();
    for (std::size_t j = 0; j < kJoints; ++j) {
      row.torque[j] = values.at(1 + j);
      row.coefficient[j] = values.at(6 + j);
      if (has_drift) row.drift[j] = values.at(11 + j);
    }
  }
  if (rows.size() != poses.size())
    throw std::runtime_error(file(".csv") + ": a row for each pose is missing");
  return rows;
}

/// Straight from one pose to another, with the same velocity all the way.
std::vector<Pose> way(const Five& from, const Five& to, const Five& v, int steps) {
  std::vector<Pose> poses;
  for (int i = 0; i <= steps; ++i) {
    Pose pose{from, v};
    for (std::size_t j = 0; j < kJoints; ++j) pose.q[j] += (to[j] - from[j]) * i / steps;
    poses.push_back(pose);
  }
  return poses;
}

/// The pool's cell without its water.
std::filesystem::path dry_cell(const Settings& settings, const std::filesystem::path& folder) {
  std::string text = test::read_text(settings.source_dir / "deploy/cells/pool_bench/cell.yaml");
  const auto media = text.find("\nmedia:"), objects = text.find("\nobjects:");
  text.erase(media, objects - media);
  text = test::replaced(text, "../../arms", (settings.source_dir / "deploy/arms").string());
  std::ofstream(folder / "dry_cell.yaml") << text;
  return folder / "dry_cell.yaml";
}

/// The greatest power that the drag gives the hand, W, over poses in either law; joint by joint where each is
/// for itself.
double greatest_push_W(const std::vector<Pose>& poses, const std::vector<Row>& rows, bool coupled) {
  double greatest = -1e9;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    double sum = 0.0;
    for (std::size_t j = 0; j < kJoints; ++j) {
      const double power_W = rows[i].torque[j] * poses[i].v[j];
      sum += power_W;
      if (!coupled) greatest = std::max(greatest, power_W);
    }
    if (coupled) greatest = std::max(greatest, sum);
  }
  return greatest;
}

/// Slowly and fast, in all directions, all over the pool.
std::vector<Pose> wander() {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(0.0, 1.0), both(-1.0, 1.0);
  std::vector<Pose> poses;
  for (int i = 0; i < 400; ++i) {
    const double speed = 0.24 * std::pow(10.0, -3.0 * unit(random));
    Pose pose{{0.72 * unit(random), 0.4 * unit(random), 0.1 + 0.3 * unit(random), both(random), unit(random)},
              {}};
    for (double& v : pose.v) v = speed * both(random);
    poses.push_back(pose);
  }
  return poses;
}

void plot_surface(Report& report, const std::vector<Pose>& poses, const std::vector<Row>& rows) {
  Table& table = report.table("surface", {"height of the tip [m]", "felt [N·s/m]", "by area [N·s/m]"});
  for (std::size_t i = 0; i < poses.size(); ++i)
    table.row({kMount_m + poses[i].q[2] - 0.26, rows[i].coefficient[2],
               kWater * area_m2(poses[i].q[2], 0.0, kSurface_m)});
  report
      .plot("surface",
            "A crane's probe goes into the pool\nμ = 2 Pa·s/m below the surface, air above it; probe 8 mm, "
            "head and column 30 mm in radius")
      .panel("", "height of the tip above the floor [m]", "coefficient of the lift, B [N·s/m]")
      .series(table, "height of the tip [m]", "felt [N·s/m]", "as sensed")
      .series(table, "height of the tip [m]", "by area [N·s/m]", "μ × area under water", Style::kDashed)
      .vertical(kSurface_m, "surface");
}

void plot_currents(Report& report, const std::vector<Pose>& swept, const std::vector<Row>& sweep,
                   const std::vector<Pose>& crossed, const std::vector<Row>& crossing) {
  Table& table = report.table("drift", {"speed [m/s]", "drag [N]", "full relative [N]"});
  for (std::size_t i = 0; i < swept.size(); ++i)
    table.row({swept[i].v[0], sweep[i].torque[0], -sweep[i].coefficient[0] * (swept[i].v[0] - kDrift_m_s)});
  Table& jet = report.table("jet", {"x [m]", "drift along x [m/s]", "drift along y [m/s]"});
  for (std::size_t i = 0; i < crossed.size(); ++i)
    jet.row({crossed[i].q[0] - 0.36, crossing[i].drift[0], crossing[i].drift[1]});
  Plot& plot = report.plot("currents",
                           "Currents: 5 cm/s along x everywhere, a jet of 15 cm/s along y in between\n"
                           "left: the bridge moves along x; right: the arm crosses the jet",
                           2);
  plot.panel("", "velocity along x [m/s]", "drag on the bridge [N]")
      .series(table, "speed [m/s]", "full relative [N]", "of the full relative velocity", Style::kDashed)
      .series(table, "speed [m/s]", "drag [N]", "as rendered: takes energy or none")
      .vertical(kDrift_m_s, "the water's speed");
  plot.panel("", "x of the arm [m]", "velocity with which the joint would drift [m/s]")
      .series(jet, "x [m]", "drift along x [m/s]", "bridge, along x")
      .series(jet, "x [m]", "drift along y [m/s]", "slide, along y")
      .vertical_band(-0.1, 0.1, "jet");
}

/// Greatest deviation of the water's force on the simulated arm from μ × area × speed through the water, over
/// speeds of the bridge; share of the greatest.
double simulated_off(const Settings& settings, const std::vector<Pose>& swept) {
  SimulatedCell cell(settings, "pool_bench");
  double off_N = 0.0, greatest_N = 0.0;
  for (const Pose& pose : swept) {
    core::JointArray q{}, v{};
    std::copy(pose.q.begin(), pose.q.end(), q.begin());
    v[0] = pose.v[0];
    const double by_area_N = -kWater * area_m2(pose.q[2], 0.0, kSurface_m) * (v[0] - kDrift_m_s);
    off_N = std::max(off_N, std::abs(cell.force(q, v)[0] - by_area_N));
    greatest_N = std::max(greatest_N, std::abs(by_area_N));
  }
  return off_N / greatest_N;
}

void run(Report& report, const Settings& settings) {
  const auto cell = settings.source_dir / "deploy/cells/pool_bench/cell.yaml";
  const auto file = [&](const char* name) { return report.folder() / name; };

  const auto down = way({0.16, 0.20, 0.40}, {0.16, 0.20, 0.02}, {0.0, 0.0, -0.1}, 190);
  const auto surface = probe(settings, cell, file("descent"), down);
  plot_surface(report, down, surface);
  double off = 0.0, dry_Nsm = 0.0;
  for (std::size_t i = 0; i < down.size(); ++i) {
    const double by_area = kWater * area_m2(down[i].q[2], 0.0, kSurface_m);
    off = std::max(off, std::abs(surface[i].coefficient[2] - by_area));
    if (by_area == 0.0) dry_Nsm = std::max(dry_Nsm, surface[i].coefficient[2]);
  }
  const double deepest = kWater * area_m2(0.02, 0.0, kSurface_m);

  std::vector<Pose> swept;  // at one place outside of the jet
  for (int i = -40; i <= 40; ++i) swept.push_back({{0.16, 0.20, 0.08}, {0.005 * i}});
  const auto sweep = probe(settings, cell, file("sweep"), swept);
  const double fastest = swept.back().v[0], with_N = sweep.back().torque[0],
               against_N = sweep.front().torque[0];
  const double offset_m_s = fastest * (with_N + against_N) / (against_N - with_N);
  double along_N = 0.0;
  for (std::size_t i = 0; i < swept.size(); ++i)
    if (swept[i].v[0] >= 0.0 && swept[i].v[0] <= kDrift_m_s)
      along_N = std::max(along_N, std::abs(sweep[i].torque[0]));

  const auto across = way({0.16, 0.20, 0.08}, {0.56, 0.20, 0.08}, {0.1}, 200);
  const auto crossing = probe(settings, cell, file("crossing"), across);
  plot_currents(report, swept, sweep, across, crossing);
  const double in_jet = area_m2(0.08, kJetBottom_m, kJetTop_m) / area_m2(0.08, 0.0, kSurface_m) * kJet_m_s;

  const auto approach = way({0.36, 0.20, 0.08}, {0.36, 0.40, 0.08}, {0.0, 0.1}, 100);
  const auto wet = probe(settings, cell, file("fuel_wet"), approach);
  const auto dry = probe(settings, dry_cell(settings, report.folder()), file("fuel_dry"), approach);
  const double water = wet.front().coefficient[1] - dry.front().coefficient[1];
  double step_off = 0.0;
  for (std::size_t i = 0; i < wet.size(); ++i)
    step_off = std::max(step_off, std::abs(wet[i].coefficient[1] - dry[i].coefficient[1] - water));

  const auto random = wander();
  auto resting = random;
  for (Pose& pose : resting) pose.v = {};
  double push_W = -1e9, rest_N = 0.0;
  for (const bool coupled : {false, true}) {
    const std::string mode = coupled ? "coupled" : "separable";
    push_W = std::max(push_W,
                      greatest_push_W(random, probe(settings, cell, file("wander"), random, mode), coupled));
    for (const Row& row : probe(settings, cell, file("rest"), resting, mode))
      for (const double torque : row.torque) rest_N = std::max(rest_N, std::abs(torque));
  }

  report.check("velocity of the water, from the drag with it and against it", offset_m_s, kDrift_m_s - 1e-6,
               kDrift_m_s + 1e-6, "m/s");
  report.check("surface: greatest deviation from μ × area under water, share of the deepest", off / deepest,
               0.0, 0.02, "");
  report.check("air: greatest coefficient", dry_Nsm, 0.0, 0.0, "N·s/m");
  report.check("with the water and slower than it: greatest drag", along_N, 0.0, 1e-12, "N");
  report.check("jet: drift of the slide in its middle ÷ that by area",
               crossing[crossing.size() / 2].drift[1] / in_jet, 0.97, 1.03, "");
  report.check("outside of the jet: drift of the slide", crossing.front().drift[1], 0.0, 0.0, "m/s");
  report.check("to the fuel: greatest coefficient of its layers ÷ that of the water",
               dry.back().coefficient[1] / water, 2.0, 1e3, "");
  report.check("to the fuel: greatest deviation of wet from dry + water, share of the water",
               step_off / water, 0.0, 1e-9, "");
  report.check("400 poses and velocities in both laws: greatest power to the hand", push_W, -1e9, 0.0, "W");
  report.check("400 poses at rest in both laws: greatest drag", rest_N, 0.0, 0.0, "N or N·m");
  report.check("simulated arm: greatest deviation of its drag from μ × area × speed through the water",
               simulated_off(settings, swept), 0.0, 0.03, "");
  report.prints_no_more("section 7.3(5) (page 240) proposes it without figures.");
  report.difference(
      "The thesis proposes simulations of submerged and partly submerged work, without figures. A fluid that "
      "flows would push a hand at rest; ours brakes the velocity relative to it as far as that takes energy "
      "from the hand, so that drag still dissuades, never pushes, and vanishes at rest.");
}

}  // namespace
}  // namespace in_submerged

Experiment submerged() {
  return {
      "submerged",
      "A probe under water, in currents",
      "section 7.3(5)",
      "Work in a pool has another operating condition in air than under water: the medium has a drag of its "
      "own, which begins at the surface and adds to that of what is near. A current is felt as an offset of "
      "the velocity, and never pushes the hand.",
      {Sabotage::kIgnoredSpeed},
      in_submerged::run};
}

}  // namespace phantom::experiments

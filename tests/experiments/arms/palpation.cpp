// A probe presses into soft tissue, beside a nodule and over it (thesis 7.3(4)): `phantom_sensing probe` as
// it is shipped, on the shipped bench, against the layers' stiffness and damping integrated by hand.

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <map>
#include <numbers>
#include <sstream>

#include "tests/experiments/arms/simulated_rig.hpp"
#include "tests/experiments/rig.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/files.hpp"

namespace phantom::experiments {
namespace in_palpation {
namespace {

// The palpation_bench in figures: m, Pa·s/m, Pa/m.
constexpr double kTop_q3_m = 0.24, kVoxel_m = 0.001, kLayer_m = 0.002;
constexpr std::array<double, 12> kMu{10, 12, 14, 16, 18, 20, 22, 24, 26, 28, 30, 32};
constexpr std::array<double, 12> kStiffness{5e5, 5e5,   5e5,   7.5e5, 7.5e5, 1e6,
                                            1e6, 1.5e6, 1.5e6, 2e6,   2.5e6, 3e6};
constexpr double kPad_m2 = std::numbers::pi * (0.008 * 0.008 - 0.0005 * 0.0005);
constexpr double kSpeed_m_s = 0.02, kTissue_q1_m = 0.13, kNodule_q1_m = 0.19;
constexpr double kHeld_m = 0.015;  // deeper, the shortest way out of the nodule is at its side

/// Pressure at a depth: the stiffness of the layers above, integrated.
double pressure_Pa(double depth_m) {
  double sum = 0.0;
  for (std::size_t i = 0; i < kStiffness.size(); ++i)
    sum += kStiffness[i] * std::clamp(depth_m - static_cast<double>(i) * kLayer_m, 0.0, kLayer_m);
  return sum;
}

/// What the probe wrote while it went down: by row the depth, and its columns by name.
struct Press {
  std::vector<double> depth_m;
  std::map<std::string, std::vector<double>> columns;
  double at(const std::string& column, double depth) const {
    const auto row = std::min_element(depth_m.begin(), depth_m.end(), [depth](double a, double b) {
      return std::abs(a - depth) < std::abs(b - depth);
    });
    return columns.at(column).at(static_cast<std::size_t>(row - depth_m.begin()));
  }
};

/// Presses down at q1 from 10 mm above the tissue to 20 mm in it.
Press press(const Settings& settings, const std::filesystem::path& files, double q1_m) {
  const auto file = [&](const char* ending) { return files.string() + ending; };
  Press result;
  {
    std::ofstream csv(file("_poses.csv"));
    csv.precision(17);
    csv << "t,q1,q2,q3,q4,q5,v1,v2,v3,v4,v5\n";
    for (int i = 0; i <= 120; ++i) {
      const double depth_m = -0.01 + 0.00025 * i;
      result.depth_m.push_back(depth_m);
      csv << 0.00025 / kSpeed_m_s * i << ',' << q1_m << ",0.15," << kTop_q3_m - depth_m << ",0,0,0,0,"
          << sabotaged(-kSpeed_m_s, settings.sabotage) << ",0,0\n";
    }
  }
  const std::vector<std::string> words{
      (settings.bin_dir / "phantom_sensing").string(),
      "probe",
      "--cell",
      (settings.source_dir / "deploy/cells/palpation_bench/cell.yaml").string(),
      "--joints",
      file("_poses.csv"),
      "--out",
      file(".csv")};
  test::Process process(words, file(".log"));
  if (process.wait() != 0)
    throw std::runtime_error("phantom_sensing probe: " + test::read_text(file(".log")));
  std::istringstream csv(test::read_text(file(".csv")));
  std::vector<std::string> names;
  std::string line, cell;
  std::getline(csv, line);
  for (std::istringstream cells(line); std::getline(cells, cell, ',');) names.push_back(cell);
  while (std::getline(csv, line)) {
    std::istringstream cells(line);
    for (std::size_t i = 0; std::getline(cells, cell, ','); ++i)
      if (names.at(i) != "motion") result.columns[names[i]].push_back(std::stod(cell));
  }
  if (result.columns.at("reaction3").size() != result.depth_m.size())
    throw std::runtime_error(file(".csv") + ": a row for each pose is missing");
  return result;
}

/// What pushes the simulated arm out where the probe was, at rest.
std::vector<double> simulated_N(const Settings& settings, const Press& press, double q1_m) {
  SimulatedCell cell(settings, "palpation_bench");
  std::vector<double> forces;
  for (const double depth_m : press.depth_m)
    forces.push_back(cell.force({q1_m, 0.15, kTop_q3_m - depth_m}, {})[2]);
  return forces;
}

void plot(Report& report, const Press& tissue, const Press& nodule, const std::vector<double>& simulated) {
  Table& table =
      report.table("force", {"depth [mm]", "tissue [N]", "by layers [N]", "nodule [N]",
                             "damping, tissue [N·s/m]", "damping, nodule [N·s/m]", "simulated [N]"});
  for (std::size_t i = 0; i < tissue.depth_m.size(); ++i)
    table.row({1e3 * tissue.depth_m[i], tissue.columns.at("reaction3")[i],
               kPad_m2 * pressure_Pa(tissue.depth_m[i]), nodule.columns.at("reaction3")[i],
               tissue.columns.at("b3")[i], nodule.columns.at("b3")[i], simulated[i]});
  Plot& figure = report.plot("force",
                             "A pad of 16 mm presses into soft tissue, beside a nodule and over it\n"
                             "twelve layers of 2 mm from 0.5 to 3 MPa/m and 10 to 32 Pa·s/m; nodule 10 MPa/m",
                             2);
  figure.panel("stiffness", "depth [mm]", "force that pushes back [N]")
      .series(table, "depth [mm]", "tissue [N]", "tissue")
      .series(table, "depth [mm]", "by layers [N]", "tissue, by its layers", Style::kDashed)
      .series(table, "depth [mm]", "simulated [N]", "tissue, on the simulated arm", Style::kDashed)
      .series(table, "depth [mm]", "nodule [N]", "over the nodule");
  figure.panel("damping", "depth [mm]", "coefficient B [N·s/m]")
      .series(table, "depth [mm]", "damping, tissue [N·s/m]", "tissue")
      .series(table, "depth [mm]", "damping, nodule [N·s/m]", "over the nodule");
}

void run(Report& report, const Settings& settings) {
  const Press tissue = press(settings, report.folder() / "press_tissue", kTissue_q1_m);
  const Press nodule = press(settings, report.folder() / "press_nodule", kNodule_q1_m);
  const std::vector<double> simulated = simulated_N(settings, tissue, kTissue_q1_m);
  plot(report, tissue, nodule, simulated);

  double off_m = 0.0, in_air_N = 0.0, pull_N = 0.0, fall_N = 0.0, drag_off = 0.0, before_N = 0.0;
  for (std::size_t i = 0; i < tissue.depth_m.size(); ++i) {
    const double depth_m = tissue.depth_m[i], force_N = tissue.columns.at("reaction3")[i],
                 b = tissue.columns.at("b3")[i];
    if (depth_m < -kVoxel_m) in_air_N = std::max(in_air_N, std::abs(force_N));
    if (depth_m > 0.002) {  // how far off in depth the force is, by the slope there
      const double slope = kPad_m2 * (pressure_Pa(depth_m + 1e-5) - pressure_Pa(depth_m - 1e-5)) / 2e-5;
      off_m = std::max(off_m, std::abs(force_N - kPad_m2 * pressure_Pa(depth_m)) / slope);
    }
    pull_N = std::min(pull_N, force_N);
    fall_N = std::max(fall_N, before_N - force_N);
    before_N = force_N;
    if (b > 0.0)
      drag_off = std::max(drag_off, std::abs(tissue.columns.at("tau3")[i] / (b * kSpeed_m_s) - 1.0));
  }
  double simulated_off_N = 0.0;
  for (std::size_t i = 0; i < simulated.size(); ++i)
    simulated_off_N =
        std::max(simulated_off_N, std::abs(simulated[i] - kPad_m2 * pressure_Pa(tissue.depth_m[i])));
  double nodule_fall_N = 0.0;
  before_N = 0.0;
  for (std::size_t i = 0; i < nodule.depth_m.size(); ++i) {
    const double force_N = nodule.columns.at("reaction3")[i];
    pull_N = std::min(pull_N, force_N);
    if (nodule.depth_m[i] > kHeld_m) continue;
    nodule_fall_N = std::max(nodule_fall_N, before_N - force_N);
    before_N = std::max(before_N, force_N);
  }
  double damping_off = 0.0;
  for (std::size_t layer = 1; layer < 9; ++layer)  // in the middle of each
    damping_off = std::max(
        damping_off,
        std::abs(tissue.at("b3", (static_cast<double>(layer) + 0.5) * kLayer_m) / (kPad_m2 * kMu[layer]) -
                 1.0));

  report.check("tissue: greatest deviation of the force from the layers' stiffness, as depth", 1e3 * off_m,
               0.0, 1.0, "mm");
  report.check("air: greatest force", in_air_N, 0.0, 0.0, "N");
  report.check("least force: a body never pulls in", pull_N, 0.0, 0.0, "N");
  report.check("greatest fall of the force on the way into the tissue", fall_N, 0.0, 1e-9, "N");
  report.check("greatest fall where the nodule begins ÷ force of the tissue 16 mm deep",
               nodule_fall_N / tissue.at("reaction3", 0.016), 0.0, 0.15, "");
  report.check("nodule: force 16 mm deep ÷ that of the tissue",
               nodule.at("reaction3", 0.016) / tissue.at("reaction3", 0.016), 1.3, 20.0, "");
  report.check("damping in eight layers: greatest deviation from μ × area", damping_off, 0.0, 0.01, "");
  report.check("drag: greatest deviation from B·v", drag_off, 0.0, 1e-9, "");
  report.check("stiffness of the lift 5 mm deep ÷ (area × that of its layer)",
               tissue.at("stiffness3", 0.005) / (kPad_m2 * kStiffness[2]), 0.9, 1.1, "");
  // The pad's rim lies 0.1 mm higher than its middle.
  report.check(
      "simulated arm: greatest deviation of its force from the layers' stiffness, share of the deepest",
      simulated_off_N / (kPad_m2 * pressure_Pa(tissue.depth_m.back())), 0.0, 0.02, "");
  report.prints_no_more("section 7.3(4) (pages 238 to 240) proposes it without figures.");
  report.difference(
      "The thesis proposes it without figures. A sensor's force is the pressure at its depth times its area, "
      "along the way in which the pressure falls, as its drag is μ times its area. Where one body lies in "
      "another, each counts its own depth: the force falls a little where the nodule begins. Where the "
      "shortest way out is at a body's side it no longer holds the pad: past the middle of the nodule.");
}

}  // namespace
}  // namespace in_palpation

Experiment palpation() {
  return {
      "palpation",
      "Soft tissue, felt through the tool",
      "section 7.3(4)",
      "The voxels hold the reaction model of body parts, which is rendered joint by joint: inner layers are "
      "felt as graded stiffness and damping, and a nodule stands apart from the tissue around it.",
      {Sabotage::kIgnoredSpeed},
      in_palpation::run};
}

}  // namespace phantom::experiments

// One arm in two resolutions (thesis 7.3(2)): a slender probe goes down to a vessel, felt in voxels of 4 mm
// and, as its own process senses it, in voxels of 0.5 mm; both as shipped in deploy/cells/surgery_bench.

#include <algorithm>
#include <cmath>
#include <vector>

#include "common/percept/closeness.hpp"
#include "common/runtime/cell/cell.hpp"
#include "components/phantom_sensing/model.hpp"
#include "tests/experiments/rig.hpp"

namespace phantom::experiments {
namespace in_resolutions {
namespace {

// The surgery_bench in figures: the tip is at z = q3 − 0.14 m, the vessel's top at 0.127 m.
constexpr double kTipOverColumn_m = -0.14, kVesselTopZ_m = 0.127, kDown_m_s = 0.01;
constexpr std::size_t kColumnJoint = 2;

/// The percept on the way down in one resolution.
struct Descent {
  double voxel_size_m = 0.0;
  std::size_t sensors = 0;
  std::vector<float> mu_by_layer;     // from the vessel outwards, as the cell file has it
  std::vector<double> layer_width_m;  // likewise
  std::vector<double> gap_m, mu, drag_N, coefficient;
};

Descent descend(const Settings& settings, const std::string& share) {
  const std::string bench = (settings.source_dir / "deploy/cells/surgery_bench/").string();
  auto config = phantom_sensing::load_config(bench + "phantom_sensing.yaml");
  config.own_share = share;
  runtime::CellConfig cell = phantom_sensing::sensed_cell(runtime::load_cell(bench + "cell.yaml"), config);
  Descent way{.voxel_size_m = cell.voxel_size_m.reference_m(), .mu_by_layer = cell.profile.mu_Pa_s_per_m};
  for (const int thickness : cell.profile.thickness_vox)
    way.layer_width_m.push_back(thickness * cell.voxel_size_m.reference_m());
  for (auto& object : cell.objects) object.profile = sabotaged(object.profile, settings.sabotage);
  const auto model = phantom_sensing::load_model(cell, config);
  way.sensors = model.skin.size();
  const workspace::Workspace world = phantom_sensing::build_workspace(cell);
  phantom_sensing::PhantomSensing sensing(model, config.percept);
  phantom_sensing::StepInputs inputs;
  const std::vector<double>& home = cell.arm(config.arm).home;
  std::copy(home.begin(), home.end(), inputs.position.begin());
  inputs.velocity[kColumnJoint] = sabotaged(-kDown_m_s, settings.sabotage);
  inputs.dt_s = 0.001;
  inputs.state_valid = true;
  inputs.workspace = {&world, percept::greatest_neighbour_mu(world)};
  for (double gap_m = 0.06; gap_m > 0.0002; gap_m -= 0.0001) {
    inputs.position[kColumnJoint] = gap_m + kVesselTopZ_m - kTipOverColumn_m;
    phantom_sensing::StepOutputs out;
    sensing.step(inputs, out);
    way.gap_m.push_back(gap_m);
    way.mu.push_back(out.worst.mu);
    way.coefficient.push_back(out.drag.minus[kColumnJoint]);
    way.drag_N.push_back(out.percept.drag_torque[kColumnJoint]);
  }
  return way;
}

/// Greatest distance between where a layer is first felt on the way down and where it begins, for all layers.
double layers_off_m(const Descent& way) {
  double off_m = 0.0, begins_m = 0.0;
  for (std::size_t layer = 0; layer < way.mu_by_layer.size(); ++layer) {
    begins_m += way.layer_width_m[layer];
    const double mu = static_cast<double>(way.mu_by_layer[layer]);
    const auto felt =
        std::find_if(way.mu.begin(), way.mu.end(), [mu](double met) { return met >= 0.999 * mu; });
    if (felt == way.mu.end()) return INFINITY;
    const auto at = static_cast<std::size_t>(felt - way.mu.begin());
    off_m = std::max(off_m, std::abs(way.gap_m[at] - begins_m));
  }
  return off_m;
}

double drag_off(const Descent& way) {
  double off = 0.0;
  for (std::size_t i = 0; i < way.gap_m.size(); ++i)
    if (way.coefficient[i] > 0.0)
      off = std::max(off, std::abs(way.drag_N[i] / (way.coefficient[i] * kDown_m_s) - 1.0));
  return off;
}

double free_until_mm(const Descent& way) {
  for (std::size_t i = 0; i < way.mu.size(); ++i)
    if (way.mu[i] > 0.0) return 1e3 * way.gap_m[i];
  return 0.0;
}

void run(Report& report, const Settings& settings) {
  const Descent coarse = descend(settings, ""), fine = descend(settings, "probe");
  Table& table = report.table("descent", {"gap [mm]", "coarse [Pa·s/m]", "fine [Pa·s/m]"});
  for (std::size_t i = 0; i < coarse.gap_m.size(); ++i)
    table.row({1e3 * coarse.gap_m[i], coarse.mu[i], fine.mu[i]});
  Plot& figure =
      report.plot("descent",
                  "A probe of 2 mm goes down to a vessel of 4 mm\n"
                  "in the voxels of the upper links, 4 mm, and in those of its own process, 0.5 mm",
                  2);
  for (const bool near : {false, true})
    figure
        .panel(near ? "the last 10 mm" : "from 60 mm above", "gap between tip and vessel [mm]",
               "greatest μ felt [Pa·s/m]")
        .series(table, "gap [mm]", "coarse [Pa·s/m]", "voxels of 4 mm")
        .series(table, "gap [mm]", "fine [Pa·s/m]", "voxels of 0.5 mm")
        .range_x(0, near ? 10 : 60);
  const auto diagonal_mm = [](const Descent& way) { return 1e3 * way.voxel_size_m * std::sqrt(3.0); };
  report.check("fine: greatest distance of a layer from where it begins", 1e3 * layers_off_m(fine), 0.0,
               diagonal_mm(fine), "mm");
  report.check("coarse: likewise", 1e3 * layers_off_m(coarse), 0.0, diagonal_mm(coarse), "mm");
  report.check("free until the gap is, fine", free_until_mm(fine), 5.0, 7.0, "mm");
  report.check("free until the gap is, coarse", free_until_mm(coarse), 41.0, 55.0, "mm");
  report.check("layers felt within the last 6 mm ÷ those of the coarse voxels",
               static_cast<double>(fine.mu_by_layer.size()) / std::ceil(0.006 / coarse.layer_width_m.front()),
               6.0, 6.0, "");
  report.check("fine: greatest deviation of the drag from B·v", drag_off(fine), 0.0, 1e-9, "");
  report.check("sensors of the probe ÷ of the whole arm in coarse voxels",
               static_cast<double>(fine.sensors) / static_cast<double>(coarse.sensors), 1.0, 100.0, "");
  report.prints_no_more(
      "section 7.3(2) (pages 238 and 239) proposes it with a bound alone: voxels below 1 mm, which ours keep.");
  report.difference(
      "The thesis proposes it without figures: fingers in a finer model than the upper links, in processes of "
      "their own. Here each process has its own cell file, so the layers are finer, too: a probe may work "
      "6 mm beside what it must not touch, where the coarse voxels would hold it in fluid all the time.");
}

}  // namespace
}  // namespace in_resolutions

Experiment resolutions() {
  return {"resolutions",
          "Two resolutions in one arm",
          "section 7.3(2)",
          "Fingers are sensed in a finer model than the upper links, by a process of their own.",
          {Sabotage::kConstantMu, Sabotage::kLayersOffByOne, Sabotage::kIgnoredSpeed},
          in_resolutions::run};
}

}  // namespace phantom::experiments

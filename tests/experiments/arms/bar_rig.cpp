#include "tests/experiments/arms/bar_rig.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <numbers>
#include <sstream>

#include "common/percept/closeness.hpp"
#include "common/runtime/cell/arm_model.hpp"
#include "tests/experiments/rig.hpp"
#include "tests/support/child_process.hpp"

namespace phantom::experiments {
namespace {

constexpr double kBarAt_m = 0.45,
                 kBarHalf_m = 0.025;  // middle of the face that the link meets; half of the bar's edge

template <class T>
std::string listed(const std::vector<T>& values) {
  std::ostringstream text;
  text.precision(9);
  for (std::size_t i = 0; i < values.size(); ++i) text << (i == 0 ? "[" : ", ") << values[i];
  return text.str() + "]";
}

}  // namespace

std::filesystem::path write_bar_cell(const std::filesystem::path& folder, const Settings& settings) {
  const auto source = [&](const char* file) { return test::read_text(settings.source_dir / file); };
  std::ofstream(folder / "arm.yaml") << test::replaced(source("deploy/arms/test_arm.yaml"),
                                                       "  - link: tip\n    axes: [{radius_m: 0.02}]\n", "");
  const auto profile = bar_cell(settings).objects.front().profile;
  const std::string cell = test::replaced(source("tests/experiments/cells/bar/cell.yaml"),
                                          "profile: {set: nonlinear_short, layer_vox: 4,",
                                          "profile: {thickness_vox: " + listed(profile.thickness_vox) +
                                              ", mu_Pa_s_per_m: " + listed(profile.mu_Pa_s_per_m) + ",");
  std::ofstream(folder / "cell.yaml")
      << test::replaced(cell, "../../../../deploy/arms/test_arm.yaml", "arm.yaml");
  return folder / "cell.yaml";
}

std::string said_by(const std::string& line, const Settings& settings, int exit_code) {
  const auto said = test::run_line((settings.bin_dir / "").string() + line);
  if (said.exit_code != exit_code) throw std::runtime_error(line + ": " + said.output);
  return said.output;
}

runtime::CellConfig bar_cell(const Settings& settings) {
  auto cell = runtime::load_cell(settings.source_dir / "tests/experiments/cells/bar/cell.yaml");
  for (auto& object : cell.objects) object.profile = sabotaged(object.profile, settings.sabotage);
  return cell;
}

phantom_sensing::PhantomModel axis_phantom(const runtime::CellConfig& cell, int count,
                                           robot::Normalisation normalisation,
                                           const std::optional<robot::ClusterSpec>& cluster) {
  auto arm = runtime::load_arm(cell.arm());
  robot::AxisSensors axis;
  axis.count = count;
  axis.radius_m = kSkinRadius_m;
  axis.cluster = cluster;
  axis.from_m = {-kLink_m, 0.0, 0.0};  // in the frame at the link's end, x along the link
  // The thesis's sensors stand as far apart as their number says: farther than the rule of one voxel allows.
  auto skin = must(robot::lay_out_skin(
      arm, {{.link = "link_under_test", .segments = {}, .axes = {axis}, .meshes = {}}},
      {.voxel_size_m = cell.voxel_size_m.reference_m(), .pitch_vox = 10.0, .normalisation = normalisation}));
  return {std::move(arm), std::move(skin), {}};
}

double bar_distance_m(double r_m, double theta_rad, double across_m) {
  // In the frame of the face that the link meets: u along the link at contact, w away from the joint's side
  // into the bar.
  const double turned = theta_rad - rad(kContact_deg);
  const double u = std::abs(r_m * std::cos(turned) - across_m * std::sin(turned) - kBarAt_m) - kBarHalf_m;
  const double w = std::abs(r_m * std::sin(turned) + across_m * std::cos(turned) - kBarHalf_m) - kBarHalf_m;
  const double outside = std::hypot(std::max(u, 0.0), std::max(w, 0.0));
  return outside + std::min(std::max(u, w), 0.0);
}

std::vector<double> swing(const phantom_sensing::PhantomModel& model, const workspace::Workspace& workspace,
                          const std::vector<double>& angles_deg, double speed_rad_s) {
  phantom_sensing::PhantomSensing phantom(model, {});
  phantom_sensing::StepInputs inputs;
  inputs.workspace = {&workspace, percept::greatest_neighbour_mu(workspace)};
  inputs.state_valid = true;
  inputs.velocity[kTheta] = speed_rad_s;
  std::vector<double> torque;
  for (const double angle_deg : angles_deg) {
    inputs.position[kTheta] = rad(angle_deg);
    phantom_sensing::StepOutputs outputs;
    phantom.step(inputs, outputs);
    torque.push_back(-outputs.percept.drag_torque[kTheta]);
  }
  return torque;
}

double ideal_mu(const workspace::LayerProfile& profile, double voxel_size_m, double distance_m) {
  // Every voxel that the surface passes is solid: the bar is thicker by half of a voxel's extent across its
  // faces. Layers begin at the centres of those voxels, which lie half a voxel out at most places.
  const double tilt = rad(kContact_deg);
  const double skin_m = 0.5 * voxel_size_m * (std::cos(tilt) + std::sin(tilt)), layers_m = 0.5 * voxel_size_m;
  if (distance_m <= skin_m) return static_cast<double>(profile.mu_skin_Pa_s_per_m);
  double edge_m = layers_m;
  for (std::size_t layer = 0; layer < profile.mu_Pa_s_per_m.size(); ++layer) {
    edge_m += profile.thickness_vox[layer] * voxel_size_m;
    if (distance_m <= edge_m) return static_cast<double>(profile.mu_Pa_s_per_m[layer]);
  }
  return 0.0;
}

double ideal_coefficient(const workspace::LayerProfile& profile, double voxel_size_m, double theta_rad) {
  constexpr int kSteps = 5700;  // a tenth of a millimetre
  double sum = 0.0;
  for (int i = 0; i < kSteps; ++i) {
    const double r_m = (i + 0.5) * kLink_m / kSteps;
    sum += ideal_mu(profile, voxel_size_m, bar_distance_m(r_m, theta_rad)) * r_m * r_m;
  }
  return sum * 2.0 * std::numbers::pi * kSkinRadius_m * kLink_m / kSteps;
}

}  // namespace phantom::experiments

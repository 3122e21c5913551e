// Which links threaten which objects: none hides another one, and the most urgent leads.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>
#include <sstream>

#include "common/core/text.hpp"
#include "common/percept/closeness.hpp"
#include "components/phantom_sensing/model.hpp"
#include "components/phantom_sensing/tests/rig.hpp"
#include "components/phantom_sensing/tools/probe.hpp"
#include "tests/support/heap_guard.hpp"

namespace phantom::phantom_sensing {
namespace {

using rig::hanging;

/// An arm of three links whose tip swings towards a box (object 1), while its upper link rests above a
/// support (object 2): two layers above, one, or without it.
struct SwingingArm {
  static constexpr std::size_t kUpper = 2, kTip = 3;
  static constexpr std::uint16_t kAhead = 1, kSupport = 2;
  static constexpr double kStep_s = 0.005, kSwing_rad_s = 2.0;

  explicit SwingingArm(const std::string& file)
      : cell(runtime::load_cell(
            std::string(PHANTOM_SOURCE_DIR "/components/phantom_sensing/tests/masked_link/") + file)),
        model(load_model(cell, {})),
        voxels(build_workspace(cell)) {}

  /// The swing's row after so many steps.
  static ProbeRow row(int step) {
    ProbeRow row;
    row.t_s = step * kStep_s;
    row.position[2] = -0.4 + kSwing_rad_s * row.t_s;
    row.velocity[2] = kSwing_rad_s;
    return row;
  }
  StepInputs inputs(int step) const {
    StepInputs inputs;
    const ProbeRow at = row(step);
    inputs.position = at.position;
    inputs.velocity = at.velocity;
    inputs.dt_s = step == 0 ? 0.0 : kStep_s;
    inputs.workspace = {&voxels, percept::greatest_neighbour_mu(voxels)};
    inputs.state_valid = true;
    return inputs;
  }

  runtime::CellConfig cell;
  PhantomModel model;
  workspace::Workspace voxels;
};

/// The columns of what `phantom_sensing probe` writes of the swing.
std::map<std::string, std::vector<std::string>> probed(const SwingingArm& arm, int steps) {
  std::vector<ProbeRow> rows;
  for (int step = 0; step < steps; ++step) rows.push_back(SwingingArm::row(step));
  std::stringstream csv;
  csv.precision(17);
  run_probe_rows(arm.model, {}, arm.voxels, rows, {}, csv);
  std::string line;
  std::getline(csv, line);
  const auto names = core::cells_of(line);
  std::map<std::string, std::vector<std::string>> columns;
  while (std::getline(csv, line)) {
    const auto cells = core::cells_of(line);
    for (std::size_t i = 0; i < names.size(); ++i) columns[names[i]].push_back(cells.at(i));
  }
  return columns;
}

constexpr int kSteps = 60, kFirstThreat = 21;  // at 0.105 s the tip is in the box's outermost layer

// A link that rests in a nearer layer hides no other one.
TEST(MaskedLink, SR20_TheTipsThreatIsToldAsWithoutTheSupport) {
  const SwingingArm without("cell_without.yaml"), with("cell_with.yaml");
  auto alone = probed(without, kSteps), hidden = probed(with, kSteps);
  for (int step = 0; step < kSteps; ++step) {
    const auto i = static_cast<std::size_t>(step);
    SCOPED_TRACE(alone["t"][i]);
    if (step < kFirstThreat) {
      EXPECT_EQ(hidden["rule"][i], "0");
      EXPECT_EQ(hidden["link"][i], "2") << "where none threatens the worst sensor leads";
      continue;
    }
    EXPECT_EQ(hidden["motion"][i], "dangerous");
    EXPECT_NE(hidden["rule"][i], "0");
    if (step == kFirstThreat) {
      EXPECT_EQ(hidden["rule"][i], "3");
    }
    for (const char* column : {"mu", "link", "sensor", "x_m", "z_m", "pgvx_m", "pgvz_m", "speed_m_s",
                               "motion", "rule", "time_to_contact_s", "gap_m", "threats"})
      EXPECT_EQ(hidden[column][i], alone[column][i]) << column;
    EXPECT_EQ(hidden["object"][i], std::to_string(SwingingArm::kAhead));
    EXPECT_GE(std::stod(hidden["greatest_mu"][i]), std::stod(alone["greatest_mu"][i]))
        << "the thickest fluid leads the drag";
  }
}

// Nor does one that is very close hide it, of which an alert is up all the while.
TEST(MaskedLink, SR20_TheTipsThreatIsToldInTimeBesideOneThatIsCloser) {
  const SwingingArm close("cell_close.yaml");
  PhantomSensing sensing(close.model, {});
  StepOutputs out;
  int alerted_at = -1, contact_at = -1;
  std::map<std::pair<std::uint32_t, std::uint16_t>, int> raised;
  std::vector<double> announced_s;  // by step, of the tip
  for (int step = 0; step < 100 && contact_at < 0; ++step) {
    sensing.step(close.inputs(step), out);
    for (const percept::Alert& alert : out.alerts.raised) {
      ++raised[{alert.at.link, alert.at.object}];
      if (alert.at.link != SwingingArm::kTip || alerted_at >= 0) continue;
      EXPECT_EQ(alert.at.object, SwingingArm::kAhead);
      alerted_at = step;
    }
    if (alerted_at >= 0) {
      EXPECT_EQ(out.percept.link, SwingingArm::kTip) << "what nears leads what rests";
      EXPECT_EQ(out.percept.motion, percept::MotionClass::kDangerous);
    }
    announced_s.push_back(-1.0);
    for (const Threat& threat : out.threats) {
      if (threat.link != SwingingArm::kTip) continue;
      announced_s.back() = threat.contact.time_s;
      if (threat.contact.gap_m == 0.0) contact_at = step;
    }
  }
  ASSERT_GE(alerted_at, 0);
  ASSERT_GT(contact_at, 0);
  const double lead_s = (contact_at - alerted_at) * SwingingArm::kStep_s;
  EXPECT_GE(lead_s, 0.15) << "the layers reach 80 mm, the tip nears at 0.4 m/s";
  // Each place has its own way and speed as the link turns: the nearer, the truer.
  EXPECT_NEAR(announced_s[static_cast<std::size_t>(alerted_at)], lead_s, 0.5 * lead_s);
  EXPECT_NEAR(announced_s[static_cast<std::size_t>(contact_at - 20)], 0.1, 0.03);
  EXPECT_LE((raised[{SwingingArm::kTip, SwingingArm::kAhead}]), 2) << "one, and one when it is very close";
}

// A person would call false what alerts again and again of a wall that the arm goes along.
TEST(Alerts, SR20_ASlowWalkAlongAWallRaisesOneAtMost) {
  const PhantomModel model = rig::suspended_model();
  robot::LinkPoses X_WL;
  model.arm.link_poses({}, X_WL);
  double nearest_m = -1e9;  // along y, the way to the wall
  for (std::size_t link = 1; link <= model.arm.joint_count(); ++link)
    for (std::size_t i = model.skin.first[link]; i < model.skin.first[link + 1]; ++i)
      nearest_m = std::max(nearest_m, (X_WL[link] * model.skin.position(i)).y());
  for (const double gap_m : {0.02, 0.06, 0.10, 0.14}) {
    const double wall_m = nearest_m + gap_m;
    const workspace::Workspace world = robot::test_worlds::make(
        [&](const Eigen::Vector3d& p) { return robot::test_worlds::layer_code(wall_m - p.y()); }, {0, 0, 1},
        0.01, [&](const Eigen::Vector3d& p, double radius_m) { return wall_m - p.y() - radius_m < 0.21; });
    StepInputs inputs = hanging(0.0, 0.0, 0.01);
    inputs.workspace = {&world, percept::greatest_neighbour_mu(world)};
    PhantomSensing sensing(model, {});
    StepOutputs out;
    std::size_t raised = 0;
    constexpr double kSpeed_m_s = 0.05, kHalf_m = 0.3;
    double x_m = 0.0, way = 1.0;
    for (double t_s = 0.0; t_s < 60.0; t_s += inputs.dt_s) {
      x_m += way * kSpeed_m_s * inputs.dt_s;
      if (std::abs(x_m) > kHalf_m) way = x_m > 0.0 ? -1.0 : 1.0;
      inputs.position[0] = x_m;
      inputs.velocity[0] = way * kSpeed_m_s;
      sensing.step(inputs, out);
      raised += out.alerts.raised.size();
    }
    EXPECT_LE(raised, gap_m < 0.04 ? model.arm.joint_count() : 1U)
        << gap_m << ": one of a link that is very close all the while, else none";
  }
}

}  // namespace
}  // namespace phantom::phantom_sensing

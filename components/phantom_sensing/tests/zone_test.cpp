// A protected zone of the cell, as the phantom feels it: fluid throughout, warned of by name, and no body.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "common/percept/closeness.hpp"
#include "common/percept/near_surface.hpp"
#include "common/runtime/cell/cell.hpp"
#include "components/phantom_sensing/model.hpp"

namespace phantom::phantom_sensing {
namespace {

/// The surgery bench with its probe, in the voxels of the operating field; without the nerve, which is a body
/// in the zone's middle.
class Zone : public testing::Test {
 protected:
  static constexpr const char* kBench = PHANTOM_SOURCE_DIR "/deploy/cells/surgery_bench/";
  static constexpr std::size_t kAcross = 1, kDown = 2;  // joints along y and z
  static constexpr double kNerve_y_m = -0.012, kZone_z_m = 0.125, kZoneRadius_m = 0.003;
  static constexpr double kTipOverColumn_m = -0.14;

  static Config config_of_probe() {
    Config config = load_config(std::string(kBench) + "phantom_sensing.yaml");
    config.own_share = "probe";
    return config;
  }
  static runtime::CellConfig fine_cell(const Config& config) {
    runtime::CellConfig cell = sensed_cell(runtime::load_cell(std::string(kBench) + "cell.yaml"), config);
    std::erase_if(cell.objects, [](const auto& object) { return object.name == "nerve"; });
    for (std::size_t i = 0; i < cell.objects.size(); ++i)
      cell.objects[i].id = static_cast<std::uint16_t>(i + 1);
    return cell;
  }

  /// The tip over the zone's axis, by so much above its surface, going down.
  StepInputs over_zone(double gap_m, double speed_m_s = 0.05) const {
    StepInputs inputs;
    const std::vector<double>& home = cell_.arm().home;
    std::copy(home.begin(), home.end(), inputs.position.begin());
    inputs.position[kAcross] += kNerve_y_m;
    inputs.position[kDown] = kZone_z_m + kZoneRadius_m + gap_m - kTipOverColumn_m;
    inputs.velocity[kDown] = -speed_m_s;
    inputs.dt_s = 0.001;
    inputs.state_valid = true;
    inputs.workspace = {&world_, percept::greatest_neighbour_mu(world_)};
    return inputs;
  }

  const Config config_ = config_of_probe();
  const runtime::CellConfig cell_ = fine_cell(config_);
  const workspace::Workspace world_ = build_workspace(cell_);
  // The whole arm's process in these voxels: it raises alerts and doubts.
  const PhantomModel model_ = [this] {
    PhantomModel model = load_model(cell_, config_);
    model.own_share.reset();
    model.shares.clear();
    return model;
  }();
  PhantomSensing sensing_{model_, config_.percept};
  StepOutputs out_;
};

TEST_F(Zone, IsFeltByNameFromItsLayersToItsMiddleAndStopsNothing) {
  const auto zone = std::ranges::find(cell_.objects, "nerve_zone", &runtime::ObjectConfig::name);
  ASSERT_NE(zone, cell_.objects.end());
  const double innermost = static_cast<double>(zone->profile.mu_Pa_s_per_m.front());
  double before = 0.0;
  std::size_t raised = 0;
  for (double gap_m = 0.008; gap_m > -2.0 * kZoneRadius_m; gap_m -= 0.0005) {
    sensing_.step(over_zone(gap_m), out_);
    ASSERT_TRUE(out_.valid);
    EXPECT_GE(out_.worst.mu, before) << gap_m;
    EXPECT_LE(out_.worst.mu, innermost) << "no body's viscosity, however deep";
    if (out_.worst.mu > 0.0) {
      EXPECT_EQ(out_.worst.object, zone->id);
    }
    if (gap_m < -0.001) {
      EXPECT_EQ(out_.worst.mu, innermost) << gap_m;
    }
    EXPECT_FALSE(out_.worst.contact.gap_m > 0.0) << "there is no surface to meet";
    for (const percept::Alert& alert : out_.alerts.raised) EXPECT_EQ(alert.at.object, zone->id);
    raised += out_.alerts.raised.size();
    before = out_.worst.mu;
  }
  EXPECT_EQ(raised, 1U) << "one alert, which names it";
  EXPECT_EQ(before, innermost);
  EXPECT_GT(out_.drag.minus[kDown], 0.0) << "dragged inside";
  sensing_.step(over_zone(-kZoneRadius_m, 0.0), out_);
  EXPECT_EQ(out_.percept.drag_torque[kDown], 0.0) << "and not pushed at rest";
}

TEST_F(Zone, HasNoSurfaceThatExplainsAContact) {
  const Eigen::Vector3d middle_m(0.0, kNerve_y_m, kZone_z_m);
  const workspace::Index3 voxel = world_.grid().index_of(middle_m);
  ASSERT_GT(world_.mu_code(voxel), 0);
  EXPECT_EQ(world_.order(voxel), 1);
  EXPECT_FALSE(percept::near_surface(world_, middle_m, 0.004).found);
}

}  // namespace
}  // namespace phantom::phantom_sensing

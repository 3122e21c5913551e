// The shipped cells with a pool and with tissue: what the simulated arm feels in them.
#include "components/slave_io/simulated_world.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <numbers>
#include <optional>
#include <random>

#include "components/slave_io/simulated_arm.hpp"
#include "components/slave_io/tests/fixture.hpp"
#include "tests/support/files.hpp"

namespace phantom::slave_io {
namespace {

/// A shipped cell with its Cartesian arm in the simulated world; in place of the drives' friction, a damper.
class Shipped {
 public:
  Shipped(const std::string& name, double damper_Ns_per_m)
      : Shipped(runtime::load_cell(PHANTOM_SOURCE_DIR "/deploy/cells/" + name + "/cell.yaml"),
                damper_Ns_per_m) {}
  Shipped(runtime::CellConfig loaded, double damper_Ns_per_m)
      : cell(std::move(loaded)),
        model(load_arm(cell, "")),
        config(load_config(kShipped, model.arm, model.home)),
        world(load_world(cell, model, config.contact)) {
    for (auto& joint : config.plant.joints) joint.viscous = damper_Ns_per_m, joint.coulomb = 0.0;
  }
  /// Puts the arm there and pushes its joints for a while; those that are not pushed are held.
  const simulation::SlavePlant& push(const core::JointArray& from, const core::JointArray& force,
                                     double seconds) {
    model.home = from;
    arm.emplace(model, config, *world.fixed, std::vector<simulation::LooseObject>(),
                load_world(cell, model, config.contact).yielding);
    simulation::SlavePlant& plant = arm->plant();
    for (int i = 0; i < static_cast<int>(seconds * 1000); ++i) {
      core::JointArray drive = force;
      for (std::size_t j = 0; j < model.arm.joint_count(); ++j)
        if (force[j] == 0.0)
          drive[j] = 1e4 * (from[j] - plant.true_position()[j]) - 2e2 * plant.true_velocity()[j];
      plant.step(drive, 0.001);
    }
    return plant;
  }

  runtime::CellConfig cell;
  ArmModel model;
  Config config;
  SimulatedWorld world;
  std::optional<SimulatedArm> arm;
};

// The skin of the pool's crane, worked out by hand: column, head, and probe, with the third joint at 0.08 m.
double area_below(double height_m) {
  const double origin_m = 0.45 + 0.08;
  double sum = 0.0;
  const auto tube = [&](double radius_m, double bottom_m, double top_m) {
    const double wet_m = std::min(origin_m + top_m, height_m) - (origin_m + bottom_m);
    sum += 2.0 * std::numbers::pi * radius_m * std::max(0.0, wet_m);
  };
  tube(0.03, 0.02, 0.45), tube(0.03, -0.09, 0.0), tube(0.008, -0.26, -0.10);
  return sum;
}

TEST(SimulatedWorld, TheShippedPoolBrakesTheSimulatedArmByItsSpeedThroughTheWater) {
  Shipped pool("pool_bench", 0.0);
  ASSERT_TRUE(pool.world.yielding);
  EXPECT_LE(static_cast<int>(pool.world.yielding->sensors()), pool.config.contact.max_points);
  const double drag = 2.0 * area_below(0.55);
  // At rest the water's drift of 5 cm/s pushes; with a push of its own the arm is soon faster than it.
  const auto& resting = pool.push({0.06, 0.20, 0.08}, {}, 0.001);
  EXPECT_NEAR(resting.contact().joint_torque_Nm[0], drag * 0.05, 0.03 * drag * 0.05);
  const auto& moving = pool.push({0.06, 0.20, 0.08}, {10.0}, 0.8);
  const double v = moving.true_velocity()[0];
  ASSERT_GT(v, 0.1);
  EXPECT_NEAR(moving.contact().joint_torque_Nm[0], -drag * (v - 0.05), 0.05 * drag * (v - 0.05));
  EXPECT_NEAR(moving.contact().joint_torque_Nm[1], 0.0, 1e-6) << "outside of the jet";
  EXPECT_FALSE(moving.contact().contact);
  const auto& in_jet = pool.push({0.36, 0.20, 0.08}, {}, 0.001);
  EXPECT_GT(in_jet.contact().joint_torque_Nm[1], 0.01 * drag) << "the jet flows along y";
  const auto& dry = pool.push({0.06, 0.20, 0.40}, {10.0}, 0.8);
  EXPECT_EQ(dry.contact().joint_torque_Nm[0], 0.0) << "over the water";
}

TEST(SimulatedWorld, TheShippedTissueHoldsTheProbeAtTheDepthOfItsLayers) {
  Shipped bench("palpation_bench", 150.0);
  const double pad_m2 = std::numbers::pi * (0.008 * 0.008 - 0.0005 * 0.0005);
  // Three layers of 2 mm with 0.5 MPa/m and two of 0.75 MPa/m: 6 kPa at 10 mm.
  const double push_N = 6e3 * pad_m2, top_q3 = 0.24;
  const auto& tissue = bench.push({0.13, 0.15, 0.25}, {0, 0, -push_N}, 10.0);
  EXPECT_NEAR(top_q3 - tissue.true_position()[2], 0.010, 2e-4);
  EXPECT_TRUE(tissue.contact().contact);
  EXPECT_EQ(bench.cell.objects.at(tissue.contact().object - 1U).name, "tissue");
  EXPECT_NEAR(tissue.contact().force_N, push_N, 0.01);
  // Over the nodule the same push ends less deep: its top lies 8 mm under the tissue's, and it is harder.
  const auto& nodule = bench.push({0.19, 0.15, 0.25}, {0, 0, -4.0 * push_N}, 10.0);
  EXPECT_EQ(bench.cell.objects.at(nodule.contact().object - 1U).name, "nodule");
  const double depth_m = top_q3 - nodule.true_position()[2];
  EXPECT_GT(depth_m, 0.009);
  const auto& beside = bench.push({0.13, 0.15, 0.25}, {0, 0, -4.0 * push_N}, 10.0);
  EXPECT_GT(top_q3 - beside.true_position()[2], depth_m + 0.005);
}

/// The shipped tissue in voxels of other sides, with a rigid post beside it.
runtime::CellConfig tissue_in_voxels(const std::string& sides_m) {
  const std::string shipped = PHANTOM_SOURCE_DIR "/deploy/cells/palpation_bench/cell.yaml";
  std::string text = test::read_text(shipped);
  text = test::replaced(text, "voxel_size_m: 0.001", "voxel_size_m: " + sides_m);
  text = test::replaced(text, "thickness_vox: [1]\n",
                        "thickness_vox: [4]\n");  // of the nodule: a layer everywhere
  text = test::replaced(text, "../../arms", PHANTOM_SOURCE_DIR "/deploy/arms");
  text = test::replaced(text, "objects:\n",
                        "objects:\n  - {name: post, primitive: {box: {size_m: [0.031, 0.023, 0.117]}}, "
                        "pose: {xyz_m: [0.13, 0.11, 0.1]}}\n");
  const std::filesystem::path file = test::new_folder() / "cell.yaml";
  std::ofstream(file) << text;
  return runtime::load_cell(file);
}

double off_box_m(const Eigen::Vector3d& p_m, const Eigen::Vector3d& middle_m, const Eigen::Vector3d& half_m) {
  const Eigen::Vector3d beyond = (p_m - middle_m).cwiseAbs() - half_m;
  return beyond.cwiseMax(0.0).norm() + std::min(0.0, beyond.maxCoeff());
}

// Layers are given in voxels of the shortest side. So a longer side, along the way in or across it, changes
// neither how deep the probe sinks nor where a rigid body's surface is.
TEST(SimulatedWorld, FlatVoxelsChangeNeitherTheTissuesDepthNorWhereRigidBodiesAre) {
  const double pad_m2 = std::numbers::pi * (0.008 * 0.008 - 0.0005 * 0.0005);
  for (const char* sides_m : {"[0.001, 0.001, 0.002]", "[0.002, 0.001, 0.001]", "[0.001, 0.004, 0.002]"}) {
    Shipped bench(tissue_in_voxels(sides_m), 150.0);
    ASSERT_FALSE(bench.cell.voxel_size_m.is_cube());
    // Pressures by hand: 3 kPa at 6 mm, 6 kPa at 10 mm, 10 kPa at 14 mm, 16 kPa at 18 mm.
    for (const auto& [pressure_Pa, depth_m] : {std::pair{3e3, 0.006}, {6e3, 0.010}, {10e3, 0.014}}) {
      const auto& tissue = bench.push({0.13, 0.15, 0.25}, {0, 0, -pressure_Pa * pad_m2}, 10.0);
      EXPECT_NEAR(0.24 - tissue.true_position()[2], depth_m, 2e-4) << sides_m << ' ' << pressure_Pa;
      EXPECT_NEAR(tissue.contact().force_N, pressure_Pa * pad_m2, 0.01) << sides_m;
    }
    std::mt19937 random(6);
    std::uniform_real_distribution<double> off(-0.06, 0.06);
    int inside = 0, outside = 0;
    for (int i = 0; i < 2000; ++i) {
      const Eigen::Vector3d p_m =
          Eigen::Vector3d(0.13, 0.11, 0.1) + Eigen::Vector3d(off(random), off(random), off(random));
      const double post_m = off_box_m(p_m, {0.13, 0.11, 0.1}, {0.0155, 0.0115, 0.0585});
      const double away_m = std::min(post_m, off_box_m(p_m, {0.0, 0.0, 0.07}, {0.08, 0.08, 0.03}));
      if (away_m > 0.9 * bench.world.fixed->range_m()) continue;
      ASSERT_NEAR(bench.world.fixed->distance_m(p_m), away_m, 1e-6) << sides_m;
      ++(post_m < 0.0 ? inside : outside);
    }
    EXPECT_GT(inside, 10);
    EXPECT_GT(outside, 500);
  }
}

TEST(SimulatedWorld, ACellInWhichNothingGivesWayHasNoneOfIt) {
  EXPECT_FALSE(load_world(hot_cell(), shipped_arm(), shipped_config().contact).yielding);
}

}  // namespace
}  // namespace phantom::slave_io

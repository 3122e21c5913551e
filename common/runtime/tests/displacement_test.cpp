// What the shipped pool's crane displaces, worked out by hand, and each fault of what a file states.
#include "common/runtime/cell/displacement.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>

#include "common/core/errors.hpp"
#include "common/runtime/cell/arm_model.hpp"

namespace phantom::runtime {
namespace {

CellConfig pool() { return load_cell(PHANTOM_SOURCE_DIR "/deploy/cells/pool_bench/cell.yaml"); }
robot::Buoyancy of_crane(const CellConfig& cell) {
  return load_buoyancy(cell, cell.arm(), load_kinematics(cell.arm()));
}
constexpr double rod_m3(double radius_m, double length_m) {
  return std::numbers::pi * radius_m * radius_m * length_m;
}

TEST(Displacement, OfTheShippedCraneIsThatOfItsRods) {
  const robot::Buoyancy crane = of_crane(pool());
  ASSERT_TRUE(crane.acts());
  EXPECT_EQ(crane.volume_m3(1), 0.0) << "the bridge stays in air";
  EXPECT_EQ(crane.volume_m3(2), 0.0);
  // Its cylinders are bars of 48 sides, 0.3 % slimmer.
  EXPECT_NEAR(crane.volume_m3(3), rod_m3(0.03, 0.43), 0.01 * rod_m3(0.03, 0.43));
  EXPECT_NEAR(crane.volume_m3(4), rod_m3(0.03, 0.09), 0.01 * rod_m3(0.03, 0.09));
  EXPECT_NEAR(crane.volume_m3(5), rod_m3(0.008, 0.16), 0.01 * rod_m3(0.008, 0.16));
}

TEST(Displacement, LiftsTheShippedCraneByWhatIsBelowTheSurface) {
  const CellConfig cell = pool();
  const robot::SerialArm arm = load_kinematics(cell.arm());
  const robot::Buoyancy crane = load_buoyancy(cell, cell.arm(), arm);
  for (double q3 = 0.0; q3 <= 0.44; q3 += 0.01) {
    robot::LinkPoses X_WL;
    arm.link_poses({0.16, 0.20, q3}, X_WL);
    core::JointArray tau{};
    crane.add_lift(arm, X_WL, tau);
    const auto wet_m3 = [&](double radius_m, double bottom_m, double top_m) {
      const double origin_m = 0.45 + q3;  // of the column, above the floor
      return rod_m3(radius_m, std::clamp(0.55 - origin_m - bottom_m, 0.0, top_m - bottom_m));
    };
    const double by_hand_N =
        -998.0 * robot::kGravity_m_s2 *
        (wet_m3(0.03, 0.02, 0.45) + wet_m3(0.03, -0.09, 0.0) + wet_m3(0.008, -0.26, -0.10));
    // A cell is as high as it is wide to a factor of 1.4: off by a few parts in a hundred of one cell.
    EXPECT_NEAR(tau[2], by_hand_N, 0.01 * std::abs(by_hand_N) + 0.1) << q3;
    EXPECT_EQ(tau[0], 0.0) << "along x nothing is lifted";
  }
}

TEST(Displacement, IsNothingWhereNoMediumHasADensity) {
  CellConfig cell = pool();
  for (MediumConfig& medium : cell.media) medium.density_kg_per_m3.reset();
  cell.arms[0].displaced.clear();
  EXPECT_FALSE(of_crane(cell).acts());
}

TEST(Displacement, IsWhatTheArmsFileStates) {
  CellConfig cell = pool();
  cell.arms[0].displaced.push_back({"head", 0.001, Eigen::Vector3d(0.2, 0.0, 0.0)});
  cell.arms[0].displaced[0].volume_m3 = 0.002;  // of the bridge, which has no visuals
  const robot::SerialArm arm = load_kinematics(cell.arm());
  const robot::Buoyancy crane = load_buoyancy(cell, cell.arm(), arm);
  EXPECT_DOUBLE_EQ(crane.volume_m3(1), 0.002);
  EXPECT_NEAR(crane.volume_m3(4), 0.001, 1e-12);
  EXPECT_GT(crane.volume_m3(5), 0.0) << "the others as before";
  // All of it under water; a force upwards has no moment about the head's vertical axis, wherever it acts.
  core::JointArray tau{};
  robot::LinkPoses X_WL;
  arm.link_poses({0.16, 0.20, 0.0}, X_WL);
  crane.add_lift(arm, X_WL, tau);
  EXPECT_EQ(tau[3], 0.0);
}

TEST(Displacement, EachFaultOfWhatIsStatedIsNamed) {
  const auto problem_of = [](const std::vector<DisplacedLinkConfig>& displaced) -> std::string {
    CellConfig cell = pool();
    cell.arms[0].displaced = displaced;
    try {
      of_crane(cell);
    } catch (const core::ConfigError& error) {
      return error.what();
    }
    return "accepted";
  };
  const DisplacedLinkConfig bridge{"bridge", 0.0, {}}, slide{"slide", 0.0, {}};
  using testing::AllOf, testing::HasSubstr;
  EXPECT_EQ(problem_of({bridge, slide}), "accepted");
  EXPECT_THAT(
      problem_of({bridge, slide, {"hook", 0.1, {}}}),
      AllOf(HasSubstr("cell.yaml: arm 'crane': displaced: link 'hook'"), HasSubstr("allowed: a moving")));
  EXPECT_THAT(problem_of({bridge, slide, {"frame", 0.1, {}}}), HasSubstr("is none that moves"));
  EXPECT_THAT(problem_of({bridge, slide, {"tip", 0.1, {}}, {"probe", 0.1, {}}}),
              HasSubstr("link 'probe' moves as one with 'tip'"));
  EXPECT_THAT(problem_of({bridge}), AllOf(HasSubstr("link 'slide' has mass but no visual"),
                                          HasSubstr("allowed: its volume, or 0")));
}

TEST(Displacement, OfTheCellsObjectsIsTheirVolume) {
  const CellConfig cell = pool();
  const auto volumes = object_volumes_m3(cell);
  ASSERT_EQ(volumes.size(), cell.objects.size());
  EXPECT_NEAR(volumes.at(3), 0.05 * 0.05 * 0.24, 1e-7) << cell.objects[2].name;
}

}  // namespace
}  // namespace phantom::runtime

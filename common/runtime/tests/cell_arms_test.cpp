// Arms as configurations: the shipped ones by the thesis's tables, and each fault by its name.
#include "common/runtime/cell/cell_arms.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <numbers>

#include "common/core/errors.hpp"
#include "common/core/units.hpp"
#include "common/geometry/mesh/mesh.hpp"
#include "common/runtime/cell/arm_model.hpp"
#include "common/runtime/cell/cell.hpp"
#include "common/runtime/configuration/fields.hpp"
#include "tests/support/files.hpp"

namespace phantom::runtime {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::ThrowsMessage;

const CellConfig& bench() {
  static const CellConfig cell = load_cell(PHANTOM_SOURCE_DIR "/deploy/cells/arm_bench/cell.yaml");
  return cell;
}

struct Axis {
  double lower, upper, speed;
};

void expect_axes(const std::string& arm_name, const std::vector<Axis>& table) {
  const robot::SerialArm arm = load_arm(bench().arm(arm_name));
  ASSERT_EQ(arm.joint_count(), table.size()) << arm_name;
  for (std::size_t j = 0; j < table.size(); ++j) {
    const robot::Joint& joint = arm.joints()[j];
    const double unit = joint.type == robot::JointType::kPrismatic ? 1.0 : core::kRadPerDegree;
    EXPECT_NEAR(joint.lower, table[j].lower * unit, 2e-6) << arm_name << " " << joint.name;
    EXPECT_NEAR(joint.upper, table[j].upper * unit, 2e-6) << arm_name << " " << joint.name;
    EXPECT_NEAR(joint.max_speed, table[j].speed * unit, 1e-6) << arm_name << " " << joint.name;
  }
}

TEST(ShippedArms, HaveTheThesissRangesAndSpeeds) {
  expect_axes(
      "suspended_arm",
      {{0, 1.8, 0.02}, {-180, 180, 10}, {-60, 60, 10}, {-90, 90, 10}, {-45, 60, 10}, {-180, 180, 20}});
  expect_axes("cartesian_probe",
              {{0, 0.72, 0.24}, {0, 0.676, 0.156}, {0, 0.442, 0.156}, {-75, 180, 50}, {0, 90, 50}});
  expect_axes("active_joystick", {{-150, 150, 18000}, {-180, 90, 18000}});
}

TEST(ShippedArms, HaveTheThesissLengthsAndTorques) {
  const robot::SerialArm test_arm = load_arm(bench().arm("test_arm"));
  const auto [from, to] = test_arm.link_axis_m(2);
  EXPECT_NEAR((to - from).norm(), 0.57, 1e-12);
  const ArmConfig& ajs = bench().arm("active_joystick");
  const robot::SerialArm joystick = load_arm(ajs);
  EXPECT_EQ(joystick.joints()[0].max_effort, 0.32);
  EXPECT_EQ(joystick.joints()[1].max_effort, 1.27);
  const auto [axis, hand] = joystick.link_axis_m(2);
  EXPECT_NEAR((hand - axis).norm(), 0.075, 1e-12);
  EXPECT_EQ(load_arm(bench().arm("wall_arm")).joint_count(), 6U);
  EXPECT_EQ(load_arm(bench().arm("scara")).joints()[2].type, robot::JointType::kPrismatic);
}

TEST(ShippedArms, TheTestArmMeetsTheBarAtFortyDegrees) {
  const robot::SerialArm arm = load_arm(bench().arm("test_arm"));
  robot::LinkPoses X_WL;
  core::JointArray q{};
  q[1] = 40.0 * core::kRadPerDegree;
  arm.link_poses(q, X_WL);
  const auto [from, to] = arm.link_axis_m(2);
  const Eigen::Vector3d a = X_WL[2] * from, b = X_WL[2] * to, bar = bench().objects[0].X_WO.translation_m;
  const double along = (bar - a).dot(b - a) / (b - a).squaredNorm();
  EXPECT_GT(along, 0.5);
  EXPECT_LT(along, 1.0);
  EXPECT_LT((a + along * (b - a) - bar).norm(), 0.025) << "the axis runs through the bar";
}

TEST(ShippedArms, TheLaboratorysGripperIsHeldAsItsFileSays) {
  const ArmConfig& config = bench().arm("laboratory_arm");
  const robot::SerialArm arm = load_arm(config);
  ASSERT_EQ(arm.joint_count(), 6U);
  // The fingers' inner faces are 4 cm apart and stand on the gripper: 7 cm + 5 cm above its frame.
  for (const auto& [finger, y_m] : {std::pair{"left_finger", 0.02}, std::pair{"right_finger", -0.02}}) {
    const auto [link, X_link_finger] = *arm.find_frame(finger);
    EXPECT_EQ(link, 6U);
    EXPECT_TRUE(X_link_finger.translation_m.isApprox(Eigen::Vector3d(0, y_m, 0.07), 1e-12)) << finger;
  }
  EXPECT_NEAR(arm.links()[6].mass_kg, 0.3 + 0.5 + 2 * 0.08, 1e-12);
  const auto skin = load_skin(config, arm);
  ASSERT_EQ(skin.size(), 5U);
  EXPECT_EQ(skin[3].meshes.size(), 1U) << "the hand's collision geometry";
  ASSERT_EQ(skin[4].meshes.size(), 4U) << "flange, gripper and two fingers";
  double volume_m3 = 0.0;
  for (const auto& sensors : skin[4].meshes) volume_m3 += geometry::enclosed_volume_m3(sensors.mesh_m);
  EXPECT_NEAR(volume_m3, std::numbers::pi * 0.03 * 0.03 * 0.02 + 0.05 * 0.15 * 0.05 + 2 * 0.02 * 0.012 * 0.07,
              2e-7);
}

/// One arm, with one line of it replaced per case, in a file of its own or in the cell's.
class ArmFile : public testing::Test {
 protected:
  void SetUp() override {
    std::ofstream(folder_ / "cell.yaml")
        << "name: bench\n"
           "workspace: {min_m: [-1, -1, 0], max_m: [1, 1, 1.5], voxel_size_m: 0.01}\n"
           "profile: {thickness_vox: [4], mu_Pa_s_per_m: [32]}\n"
           "arms: [{name: arm, file: arm.yaml, mount: {xyz_m: [0, 0, 0.5]}}]\n";
  }

  ArmConfig load(const std::string& from = "", const std::string& to = "") {
    const std::string text = from.empty() ? kArm : test::replaced(kArm, from, to);
    std::ofstream(folder_ / "arm.yaml") << text;
    const CellConfig cell = load_cell(folder_ / "cell.yaml");
    const robot::SerialArm arm = load_arm(cell.arm());
    load_skin(cell.arm(), arm);
    return cell.arm();
  }
  void expect_refused(const std::string& from, const std::string& to, const std::string& message) {
    EXPECT_THAT([&] { load(from, to); }, ThrowsMessage<ConfigError>(HasSubstr(message))) << to;
    EXPECT_THAT([&] { load(from, to); }, ThrowsMessage<ConfigError>(HasSubstr("arm.yaml")))
        << "names the arm's own file";
  }

  static constexpr const char* kArm = R"(dh:
  convention: classic
  rows:
    - {link: base_turn, d_m: 0.3, alpha_deg: 90, range_deg: [-90, 90], max_speed_deg_s: 30, max_torque_Nm: 50,
       mass_kg: 2, inertia_kg_m2: [0.2, 0.3, 0.4, 0.01, 0.02, 0.03]}
    - {link: slide, type: prismatic, range_m: [0, 0.4], max_speed_m_s: 0.1, max_force_N: 200}
home: [0, 0.1]
skin:
  - link: base_turn
    segments: [{offset_m: 0.05, length_m: 0.2, from_polygon: {r_m: [0.05, 0.05, 0.05], psi_deg: [0, 120, 240]}}]
  - link: slide
    axes: [{from_m: [0, 0, 0], to_m: [0, 0, 0.2], count: 30, cluster: {reach_vox: 3, shape: fraction}, tip_reach_vox: 1}]
interest_points: [{name: end, link: slide, position_m: [0, 0, 0.2]}]
displaced: [{link: base_turn, volume_m3: 0.002}, {link: slide, volume_m3: 0.001, centre_m: [0, 0, 0.1]}]
)";
  const std::filesystem::path folder_ = test::new_folder();
};

TEST_F(ArmFile, LoadsWithUnits) {
  const ArmConfig arm = load();
  EXPECT_EQ(arm.X_WB.translation_m.z(), 0.5);
  ASSERT_EQ(arm.dh.size(), 2U);
  EXPECT_NEAR(arm.dh[0].alpha_rad, std::numbers::pi / 2, 1e-12);
  EXPECT_NEAR(arm.dh[0].max_speed, 30 * core::kRadPerDegree, 1e-12);
  EXPECT_EQ(arm.dh[1].upper, 0.4);
  Eigen::Matrix3d inertia;
  inertia << 0.2, 0.01, 0.02, 0.01, 0.3, 0.03, 0.02, 0.03, 0.4;
  EXPECT_EQ(arm.dh[0].inertia_kg_m2, inertia);
  EXPECT_EQ(arm.skin[1].axes[0].cluster->shape, robot::ClusterShape::kFraction);
  EXPECT_EQ(arm.skin[1].axes[0].tip_reach_vox, 1);
  ASSERT_EQ(arm.displaced.size(), 2U);
  EXPECT_EQ(arm.displaced[0].volume_m3, 0.002);
  EXPECT_FALSE(arm.displaced[0].centre_m);
  EXPECT_EQ(arm.displaced[1].centre_m, Eigen::Vector3d(0, 0, 0.1));
  const auto skin = load_skin(arm, load_arm(arm));
  EXPECT_NEAR((skin[0].segments[0].to_m - skin[0].segments[0].from_m).norm(), 0.2, 1e-12)
      << "placed along the axis";
}

TEST_F(ArmFile, AnEndlessJointNeedsNoRange) {
  EXPECT_TRUE(std::isinf(load("range_deg: [-90, 90], ", "").dh[0].upper));
}

TEST_F(ArmFile, NamesHeldJointsThatTheUrdfDoesNotHold) {
  std::ofstream(folder_ / "arm.urdf") << test::text_of(PHANTOM_SOURCE_DIR "/deploy/arms/laboratory_arm.urdf");
  const auto refusal = [&](const std::string& held) -> std::string {
    std::ofstream(folder_ / "arm.yaml")
        << "urdf: arm.urdf\ntip_link: tool\nhome: [0, 0, 0, 0, 0, 0]\n" + held;
    try {
      load_arm(load_cell(folder_ / "cell.yaml").arm());
    } catch (const ConfigError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(refusal(""), "");
  EXPECT_EQ(refusal("held_joints: {finger_left: 0.05}"), "");
  EXPECT_THAT(
      refusal("held_joints: {finger_left: 0.06}"),
      AllOf(HasSubstr("arm.yaml: arm 'arm': "), HasSubstr("arm.urdf: held_joints: 0.06 for 'finger_left'"),
            HasSubstr("allowed: 0 to 0.05")));
  EXPECT_THAT(refusal("held_joints: {finger: 0.06}"),
              HasSubstr("'finger' is no joint of the file; allowed: finger_left"));
  EXPECT_THAT(
      refusal("held_joints: {finger_left: wide}"),
      HasSubstr(
          "arm.yaml:4: held_joints.finger_left: 'wide' is not a number; allowed: -36000 to 36000 rad or m"));
  EXPECT_THAT([&] { load("home:", "held_joints: {slide: 0}\nhome:"); },
              ThrowsMessage<ConfigError>(HasSubstr("held_joints: unknown key")))
      << "of a URDF only";
}

// A vendor's file stays as it is, also with an effort of 0.
TEST_F(ArmFile, StatesLimitsInsteadOfTheUrdfs) {
  std::string urdf = test::text_of(PHANTOM_SOURCE_DIR "/deploy/arms/laboratory_arm.urdf");
  const std::size_t effort = urdf.find("effort=\"");
  urdf.replace(effort, urdf.find('"', effort + 8) + 1 - effort, "effort=\"0\"");
  std::ofstream(folder_ / "arm.urdf") << urdf;
  const auto written = [&](const std::string& limits) {
    std::ofstream(folder_ / "arm.yaml")
        << "urdf: arm.urdf\ntip_link: tool\nhome: [0, 0, 0, 0, 0, 0]\n" + limits;
    return load_cell(folder_ / "cell.yaml").arm();
  };
  const auto refusal = [&](const std::string& limits) -> std::string {
    try {
      load_arm(written(limits));
    } catch (const ConfigError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_THAT(refusal(""), HasSubstr("effort must be above 0; max_efforts of the arm's file may state it"));
  const std::string first = "waist";
  const robot::SerialArm arm = load_arm(written("max_efforts: {" + first + ": 55}\nlower_limits: {" + first +
                                                ": -0.5}\nmax_speeds: {" + first + ": 0.25}\n"));
  EXPECT_EQ(arm.joints()[0].max_effort, 55.0);
  EXPECT_EQ(arm.joints()[0].max_speed, 0.25);
  EXPECT_EQ(arm.joints()[0].lower, -0.5);
  EXPECT_GT(arm.joints()[0].upper, 0.0);
  EXPECT_THAT(refusal("max_efforts: {finger_left: 5}"),
              HasSubstr("max_efforts: 'finger_left' is no moving joint of the chain; allowed: " + first));
  EXPECT_THAT(refusal("max_efforts: {" + first + ": 0}"), HasSubstr("max_efforts." + first));
}

TEST_F(ArmFile, EachFaultIsNamed) {
  expect_refused("convention: classic", "convention: denavit", "allowed: classic, modified");
  expect_refused("dh:\n", "urdf: arm.urdf\ndh:\n", "stands beside urdf");
  expect_refused("range_deg: [-90, 90]", "range_deg: [90, -90]", "lower below upper");
  expect_refused("range_m: [0, 0.4], ", "", "range_m: is missing");
  expect_refused("max_speed_deg_s: 30", "max_speed_deg_s: 0", "0.001 to 36000 degrees/s");
  expect_refused("max_force_N: 200", "max_torque_Nm: 200", "max_force_N: is missing");
  expect_refused(", 0.01, 0.02, 0.03]", "]", "is not [xx, yy, zz, xy, xz, yz]");
  expect_refused("type: prismatic", "type: screw", "allowed: revolute, prismatic");
  expect_refused("home: [0, 0.1]", "home: [0]", "home: has 1 values; allowed: 2");
  expect_refused("home: [0, 0.1]", "home: [0, 0.5]", "is outside of its limits; allowed: 0.0");
  expect_refused("skin:", "torque_constants_Nm_A: [0.3, 0]\nskin:", "torque_constants_Nm_A");
  expect_refused("psi_deg: [0, 120, 240]", "psi_deg: [0, 120]", "has 2 values for 3 of r_m");
  expect_refused("offset_m: 0.05", "from_m: [0, 0, 0]", "one way to place a segment");
  expect_refused("length_m: 0.2,", "length_m: 0.2, from_radius_m: 0.1,", "stands beside a radius");
  expect_refused("shape: fraction", "shape: star", "allowed: cube, sphere, sphere-contained, fraction");
  expect_refused("tip_reach_vox: 1", "tip_reach_vox: 4", "1 to 3 voxels");
  expect_refused("reach_vox: 3,", "reach_vox: 16,", "1 to 15 voxels");
  expect_refused("count: 30", "count: 0", "allowed: 1 to 100000 sensors");
  expect_refused("axes: [{from_m: [0, 0, 0]", "axes: [{from_m: [0, 0, 0.2]", "is the same point as from_m");
  expect_refused("  - link: slide\n    axes", "  - link: slide\n    lines",
                 "at least one of segments, axes, meshes");
  EXPECT_THAT([&] { load("axes: [", "meshes: [{mesh: gone.stl}]\n    axes: ["); },
              ThrowsMessage<core::MissingError>(
                  testing::AllOf(HasSubstr("arm.yaml"), HasSubstr("'gone.stl' is not there"))));
  expect_refused("axes: [", "meshes: [{gain: 1}]\n    axes: [", "has no visuals");
  expect_refused("interest_points: [", "interest_points: [{name: end, link: slide, position_m: [0, 0, 0]}, ",
                 "stands twice");
  expect_refused("home:", "colour: red\nhome:", "unknown key");
}

}  // namespace
}  // namespace phantom::runtime

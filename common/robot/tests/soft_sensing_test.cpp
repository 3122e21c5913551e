// What soft bodies do to an arm that presses into them, against the sums written out sensor by sensor.
#include "common/robot/sensing/soft_sensing.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "common/robot/tests/test_arms.hpp"
#include "common/robot/tests/test_worlds.hpp"
#include "tests/support/heap_guard.hpp"

namespace phantom::robot {
namespace {

using core::JointArray;

constexpr std::size_t kSoftJoints = 7;
constexpr double kVoxel_m = 0.01;
constexpr std::uint16_t kTissue = 4;
constexpr std::int32_t kTop = 60;  // index of the slab's boundary voxels along z

workspace::LayerProfile tissue() {
  workspace::LayerProfile profile;
  profile.thickness_vox = {3};
  profile.mu_Pa_s_per_m = {10.0F};
  profile.inside_thickness_vox = {2, 3};
  profile.mu_inside_Pa_s_per_m = {20.0F, 40.0F};
  profile.stiffness_inside_Pa_per_m = {1e5, 4e5};
  return profile;
}

/// Order of a voxel of a slab under the plane of its boundary.
std::int8_t slab_order(std::int32_t z) {
  const int depth = kTop - z;
  if (depth < -3) return workspace::kOrderFree;
  if (depth < 0) return 1;
  if (depth == 0) return workspace::kOrderBoundary;
  return depth <= 2 ? std::int8_t{-1} : depth <= 5 ? std::int8_t{-2} : workspace::kOrderInterior;
}
/// Pressure in that voxel's middle, by hand: 1 kPa per voxel in the first layer, 4 kPa in the second.
double slab_pressure_Pa(std::int32_t z) {
  switch (slab_order(z)) {
    case -1:
      return 1500.0;
    case -2:
      return 2000.0 + 0.5 * 4.0 * 4000.0;
    case workspace::kOrderInterior:
      return 14000.0;
    default:
      return 0.0;
  }
}

/// A slab 1.6 m wide whose top is at a height of 0.61 m.
const workspace::Workspace& slab() {
  static const workspace::Workspace world = [] {
    workspace::GridSpec grid{{-0.8, -0.8, 0.0}, kVoxel_m, {160, 160, 160}};
    workspace::Workspace made(grid, {0.0F, 10.0F, 20.0F, 40.0F, 100.0F});
    for (std::int32_t z = 0; z <= kTop + 3; ++z)
      for (std::int32_t y = 0; y < 160; ++y)
        for (std::int32_t x = 0; x < 160; ++x) {
          const std::int8_t order = slab_order(z);
          const auto brick = made.edit_brick(workspace::brick_of({x, y, z}));
          const std::size_t at = workspace::brick_offset(workspace::Index3{x, y, z});
          brick.mu_code[at] = order == 1 ? 1 : order == -2 ? 3 : order == workspace::kOrderInterior ? 4 : 2;
          brick.order[at] = order;
          brick.object[at] = kTissue;
        }
    made.version = 1;
    return made;
  }();
  return world;
}

struct SoftRig {
  SoftRig()
      : arm(test_arms::suspended(test_arms::at(0.0, 0.0, 1.5))),
        layout(*lay_out_skin(arm, test_worlds::tubes(), {.voxel_size_m = kVoxel_m})),
        sensing(layout, {}),
        soft({soft_body(kTissue, tissue(), kVoxel_m)}) {}

  JointReaction at(const JointArray& q) {
    arm.link_poses(q, X_WL);
    sensing.sense(X_WL, arm.joint_count(), slab());
    soft.sense(sensing, X_WL, slab());
    JointReaction reaction;
    joint_reaction(arm, X_WL, soft.links(), q, reaction);
    return reaction;
  }

  SerialArm arm;
  SkinLayout layout;
  SkinSensing sensing;
  SoftSensing soft;
  LinkPoses X_WL;
};

TEST(SoftBody, HasThePressureOfItsLayersMiddles) {
  const SoftBody body = soft_body(kTissue, tissue(), kVoxel_m);
  EXPECT_NEAR(body.pressure_Pa[0xFF], 1500.0, 1e-9);
  EXPECT_NEAR(body.pressure_Pa[0xFE], 10000.0, 1e-9);
  EXPECT_NEAR(body.pressure_Pa[workspace::kOrderInterior], 14000.0, 1e-9);
  EXPECT_EQ(body.pressure_Pa[workspace::kOrderBoundary], 0.0);
  EXPECT_EQ(body.pressure_Pa[1], 0.0) << "outside";
  EXPECT_EQ(body.stiffness_Pa_per_m[workspace::kOrderBoundary], 1e5);
  EXPECT_EQ(body.stiffness_Pa_per_m[0xFE], 4e5);
  EXPECT_EQ(body.stiffness_Pa_per_m[workspace::kOrderInterior], 0.0);
}

TEST(SoftSensing, EqualsTheSumOverAllSensorsOfAreaTimesPressureUpwards) {
  SoftRig rig;
  std::mt19937 random(4);
  int pressed = 0;
  for (int trial = 0; trial < 40; ++trial) {
    const JointArray q = test_arms::random_joints(rig.arm, random, 1.0);
    const JointReaction reaction = rig.at(q);
    JointArray torque{}, stiffness{};
    double size = 1e-9;
    for (std::size_t link = 1; link <= kSoftJoints; ++link) {
      for (std::size_t i = rig.layout.first[link]; i < rig.layout.first[link + 1]; ++i) {
        const Eigen::Vector3d p = rig.X_WL[link] * rig.layout.position(i);
        if (!slab().grid().contains(slab().grid().index_of(p))) continue;
        const double z = p.z() / kVoxel_m;
        const auto voxel = static_cast<std::int32_t>(std::floor(z));
        if (voxel > kTop || voxel < kTop - 5 - SoftSensing::kReach_vox) continue;
        const auto below = static_cast<std::int32_t>(std::floor(z - 0.5));
        const double share = z - 0.5 - below;
        const double pressure = (1.0 - share) * slab_pressure_Pa(below) + share * slab_pressure_Pa(below + 1);
        const double k = voxel >= kTop - 2 ? 1e5 : voxel >= kTop - 5 ? 4e5 : 0.0;
        if (!(pressure > 0.0)) continue;
        const double area = rig.layout.area_m2[i];
        size += area * pressure;
        for (std::size_t j = 0; j < kSoftJoints; ++j) {
          JointArray unit{};
          unit[j] = 1.0;
          const double up = rig.arm.point_velocity_W(link, p, rig.X_WL, unit).z();
          torque[j] += area * pressure * up;
          stiffness[j] += area * k * up * up;
        }
      }
    }
    pressed += size > 1.0 ? 1 : 0;
    for (std::size_t j = 0; j < kSoftJoints; ++j) {
      EXPECT_NEAR(reaction.torque[j], torque[j], 1e-9 * size) << j;
      EXPECT_NEAR(reaction.stiffness[j], stiffness[j], 1e-9 * (stiffness[j] + size)) << j;
      EXPECT_GE(reaction.stiffness[j], 0.0);
    }
    EXPECT_EQ(reaction.position, q);
  }
  EXPECT_GT(pressed, 5);
}

/// Tissue under a slope of 45°, in voxels that are twice as high as wide; it falls along +x.
workspace::Workspace slope(const Eigen::Vector3d& normal) {
  workspace::GridSpec grid{{-0.8, -0.8, 0.0},
                           workspace::VoxelSize(Eigen::Vector3d(kVoxel_m, kVoxel_m, 2.0 * kVoxel_m)),
                           {160, 160, 80}};
  workspace::Workspace made(grid, {0.0F, 20.0F, 40.0F, 100.0F});
  workspace::VoxelBox::of(grid).for_each([&](workspace::Index3 v) {
    const double depth_vox = normal.dot(Eigen::Vector3d(0, 0, 0.61) - grid.centre_of(v)) / kVoxel_m;
    if (depth_vox < 0.0) return;
    const auto brick = made.edit_brick(workspace::brick_of(v));
    const std::size_t at = workspace::brick_offset(v);
    brick.order[at] = depth_vox < 1.0   ? workspace::kOrderBoundary
                      : depth_vox < 3.0 ? std::int8_t{-1}
                      : depth_vox < 6.0 ? std::int8_t{-2}
                                        : workspace::kOrderInterior;
    brick.mu_code[at] = 3;
    brick.object[at] = kTissue;
  });
  return made;
}

TEST(SoftSensing, PushesAlongTheTrueNormalWhereVoxelsAreNoCubes) {
  const Eigen::Vector3d normal = Eigen::Vector3d(1, 0, 1).normalized();
  const workspace::Workspace world = slope(normal);
  SoftRig rig;
  std::mt19937 random(6);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  int pressed = 0;
  for (int trial = 0; trial < 60; ++trial) {
    rig.arm.link_poses(test_arms::random_joints(rig.arm, random, 1.0), rig.X_WL);
    rig.sensing.sense(rig.X_WL, rig.arm.joint_count(), world);
    rig.soft.sense(rig.sensing, rig.X_WL, world);
    for (std::size_t link = 1; link <= kSoftJoints; ++link) {
      const Eigen::Vector3d& force_N = rig.soft.links()[link].force_N;
      if (!(force_N.norm() > 1e-3)) continue;
      ++pressed;
      sum += force_N.normalized();
    }
  }
  EXPECT_GT(pressed, 20);
  const double slope_deg = std::atan2(sum.x(), sum.z()) * 180.0 / M_PI;
  EXPECT_NEAR(slope_deg, 45.0, 5.0) << "steps counted as voxels give 63° from the horizontal";
}

TEST(SoftSensing, OthersBodiesAndMutedOnesDoNotPush) {
  SoftRig rig;
  std::mt19937 random(4);
  JointArray q{};
  while (rig.at(q).torque == JointArray{}) q = test_arms::random_joints(rig.arm, random, 1.0);
  for (std::size_t link = 1; link <= kSoftJoints; ++link) rig.sensing.mute(link, kTissue, true);
  EXPECT_EQ(rig.at(q).torque, JointArray{});
  for (std::size_t link = 1; link <= kSoftJoints; ++link) rig.sensing.mute(link, kTissue, false);
  EXPECT_NE(rig.at(q).torque, JointArray{});
  rig.soft = SoftSensing({soft_body(kTissue + 1, tissue(), kVoxel_m)});
  EXPECT_EQ(rig.at(q).torque, JointArray{});
}

TEST(SoftSensing, ATickAllocatesNothing) {
  SoftRig rig;
  std::mt19937 random(4);
  JointArray q{};
  while (rig.at(q).torque == JointArray{}) q = test_arms::random_joints(rig.arm, random, 1.0);
  JointReaction reaction;
  const test::HeapGuard guard;
  rig.soft.sense(rig.sensing, rig.X_WL, slab());
  joint_reaction(rig.arm, rig.X_WL, rig.soft.links(), q, reaction);
}

}  // namespace
}  // namespace phantom::robot

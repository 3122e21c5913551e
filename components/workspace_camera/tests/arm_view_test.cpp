#include "components/workspace_camera/arm_view.hpp"

#include <gtest/gtest.h>

#include "common/fusion/fused_block.hpp"
#include "components/workspace_camera/tests/rig.hpp"

namespace phantom::workspace_camera::arm_view_test {
namespace {

using namespace rig;

core::JointArray at(double x_m) {
  core::JointArray q{};
  q[0] = x_m;
  return q;
}

TEST(ArmHistory, GivesThePoseOfATimeBetweenTwo) {
  ArmHistory history;
  EXPECT_FALSE(history.at(kStart));
  EXPECT_EQ(history.newest_ns(), 0);
  history.put(kStart, at(0.0));
  history.put(kStart + 10 * kMs, at(0.1));
  history.put(kStart + 20 * kMs, at(0.3));
  EXPECT_FALSE(history.at(kStart - kMs));
  EXPECT_NEAR(history.at(kStart)->q[0], 0.0, 1e-12);
  EXPECT_NEAR(history.at(kStart + 5 * kMs)->q[0], 0.05, 1e-12);
  EXPECT_NEAR(history.at(kStart + 15 * kMs)->q[0], 0.2, 1e-12);
  EXPECT_NEAR(history.at(kStart + 20 * kMs)->q[0], 0.3, 1e-12);
}

TEST(ArmHistory, SaysNothingOfATimeThatItDoesNotKnow) {
  ArmHistory history;
  history.put(kStart, at(0.0));
  history.put(kStart + 200 * kMs, at(0.2));  // a gap: the arm was not heard
  EXPECT_FALSE(history.at(kStart + 100 * kMs));
  EXPECT_TRUE(history.at(kStart + 200 * kMs + ArmHistory::kAhead_ns));
  EXPECT_FALSE(history.at(kStart + 201 * kMs + ArmHistory::kAhead_ns));
}

TEST(ArmHistory, KeepsTheNewestOfMany) {
  ArmHistory history;
  for (int i = 0; i <= 5000; ++i) history.put(kStart + i * kMs, at(1e-3 * i));
  EXPECT_FALSE(history.at(kStart + 100 * kMs));
  EXPECT_NEAR(history.at(kStart + 4000 * kMs)->q[0], 4.0, 1e-9);
  history.put(kStart + 10 * kMs, at(-1.0));  // late: out of order
  EXPECT_EQ(history.newest_ns(), kStart + 5000 * kMs);
}

TEST(ArmView, MarksItsOwnPlaceAndThatOfWhatItCarries) {
  ArmView view = arm_view();
  const workspace::VoxelBox blocks = fusion::blocks_of(grid());
  std::vector<std::uint8_t> own(blocks.voxel_count());
  const auto is_own = [&](const Eigen::Vector3d& place_m) {
    return own[blocks.index(fusion::block_of(grid().index_of(place_m)))] != 0;
  };
  view.mark_own({at(0.1), 0.0}, grid(), 0.02, own);
  for (const double z_m : {0.22, 0.4, 0.58}) EXPECT_TRUE(is_own({0.1, 0.0, z_m})) << z_m;
  EXPECT_TRUE(is_own({0.1 + 0.03 + 0.015, 0.0, 0.4})) << "the margin, too";
  EXPECT_FALSE(is_own({0.1 + 0.03 + 0.02 + 0.081, 0.0, 0.4})) << "a block farther";
  EXPECT_FALSE(is_own({0.1, 0.0, 0.6 + 0.02 + 0.081}));
  EXPECT_FALSE(is_own({-0.3, 0.0, 0.4}));
  view.set_carried({{view.arm().find_frame("rod")->first,
                     {Eigen::Matrix3d::Identity(), {-0.3, 0.0, 0.0}},
                     geometry::make_box({0.1, 0.1, 0.1})}});
  view.mark_own({at(0.1), 0.0}, grid(), 0.0, own);
  EXPECT_TRUE(is_own({0.1, 0.0, 0.7})) << "−x of the link is up in W";
  view.set_carried({});
  const std::vector<std::uint8_t> before = own;
  view.mark_own({at(5.0), 0.0}, grid(), 0.02, own);
  EXPECT_EQ(own, before) << "outside of the grid is nothing to mark";
}

TEST(ArmView, DrawsTheArmWhereItIs) {
  ArmView view = arm_view();
  const auto camera = config().cameras[0].simulated.camera;
  const geometry::Pose X_WC = looking_at({0.0, -1.0, 0.4}, {0.0, 0.0, 0.4});
  std::vector<float> depth_m;
  const auto pixel = [&](double x_m) {
    const double u = camera.fx_px * x_m / 1.0 + camera.cx_px;
    return depth_m[60 * 160 + static_cast<std::size_t>(std::lround(u))];
  };
  view.draw({at(0.0), 0.0}, camera, X_WC, depth_m);
  EXPECT_NEAR(pixel(0.0), 0.97, 0.02);
  EXPECT_EQ(pixel(0.2), 0.0F);
  view.draw({at(0.2), 0.0}, camera, X_WC, depth_m);
  EXPECT_EQ(pixel(0.0), 0.0F);
  EXPECT_NEAR(pixel(0.2), 0.97, 0.02);
}

TEST(ArmView, WhatItCarriesIsAPartOfIt) {
  ArmView view = arm_view();
  const auto camera = config().cameras[0].simulated.camera;
  const geometry::Pose X_WC = looking_at({0.0, -1.0, 0.4}, {0.0, 0.0, 0.4});
  view.set_carried(
      {{1, {Eigen::Matrix3d::Identity(), {0.0, 0.0, 0.15}}, geometry::make_box({0.1, 0.1, 0.1})}});
  std::vector<float> depth_m;
  view.draw({at(0.0), 0.0}, camera, X_WC, depth_m);
  const double u = camera.fx_px * 0.15 / 0.95 + camera.cx_px;  // 15 cm along x of W, which is z of the link
  EXPECT_NEAR(depth_m[60 * 160 + static_cast<std::size_t>(std::lround(u))], 0.95, 0.02);
}

}  // namespace
}  // namespace phantom::workspace_camera::arm_view_test

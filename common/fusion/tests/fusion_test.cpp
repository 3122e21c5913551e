// Fusion of exact images: what is known, free, occupied, unknown; masks, policies and bounds.
#include "common/fusion/fusion.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "common/fusion/tests/scenes.hpp"
#include "tests/support/heap_guard.hpp"

namespace phantom::fusion {
namespace {

using scenes::placed;
using workspace::Index3;
using workspace::VoxelBox;

/// 0.4 m before a camera that looks along x from the grid's side; a wall at x = 0.2.
FusionParameters small_fusion() {
  FusionParameters parameters;
  parameters.grid = {{0.0, -0.16, -0.16}, 0.005, {80, 64, 64}};
  parameters.max_blocks = 1500;
  return parameters;
}
const geometry::Pose kFromAside = scenes::looking_at({-0.5, 0.0, 0.0}, {1.0, 0.0, 0.0});

scenes::Simulated wall(double x_m = 0.2) {
  return {{placed(geometry::make_box({0.1, 3.0, 3.0}), {x_m + 0.05, 0.0, 0.0})},
          scenes::depth_camera(2),
          kFromAside};
}

Fusion fused(const FusionParameters& parameters, const DepthImage& image, int frames = 5) {
  Fusion fusion = Fusion::create(parameters).value();
  for (int i = 0; i < frames; ++i) fusion.integrate(image);
  return fusion;
}

TEST(Fusion, KeepsUnknownApartFromFree) {
  scenes::Simulated camera = wall();
  const Fusion fusion = fused(small_fusion(), camera.exact(), 20);
  // The wall begins at voxel 40.
  for (const std::int32_t x : {36, 38, 39, 40, 42, 43}) {
    const Index3 v{x, 32, 32};
    EXPECT_GT(fusion.weight(v), 0) << x;
    EXPECT_NEAR(fusion.distance_vox(v), std::clamp(39.5 - x, -4.0, 4.0), 0.02) << x;
  }
  EXPECT_EQ(fusion.weight({50, 32, 32}), 0);
  EXPECT_EQ(fusion.coverage({7, 4, 4}), 0.0);  // behind the wall
  EXPECT_EQ(fusion.coverage({2, 4, 4}), 1.0);  // seen through, without content
  EXPECT_GT(fusion.coverage({5, 4, 4}), 0.3);
  EXPECT_LT(fusion.coverage({5, 4, 4}), 0.9);
  for (std::int32_t x = 0; x < 80; ++x)
    EXPECT_EQ(fusion.occupied().get({x, 32, 32}), x >= 40 && x <= 42) << x;
}

TEST(Fusion, UnknownSpaceFollowsThePolicyOfItsRegion) {
  FusionParameters parameters = small_fusion();
  parameters.unknown_regions = {{{{0, 0, 32}, {80, 64, 32}}, UnknownPolicy::kOccupied},
                                {{{64, 0, 32}, {16, 64, 32}}, UnknownPolicy::kFree}};
  scenes::Simulated camera = wall();
  Fusion fusion = fused(parameters, camera.exact(), 0);
  EXPECT_EQ(fusion.occupied().count(), 64U * 64U * 32U);
  for (int i = 0; i < 20; ++i) fusion.integrate(camera.exact());
  for (std::int32_t x = 0; x < 80; ++x) {
    EXPECT_EQ(fusion.occupied().get({x, 32, 20}), x >= 40 && x <= 42) << x;
    EXPECT_EQ(fusion.occupied().get({x, 32, 40}), x >= 40 && x < 64) << x;  // until it is seen to be free
  }
  fusion.clear_changes();
  fusion.forget(VoxelBox::of(parameters.grid));
  EXPECT_EQ(fusion.weight({39, 32, 32}), 0);
  EXPECT_TRUE(fusion.occupied().get({41, 32, 20}));  // ignore: stays as it was
  EXPECT_TRUE(fusion.occupied().get({10, 32, 40}));
  EXPECT_FALSE(fusion.changed_blocks().empty());
}

TEST(Fusion, TheArmIsNeitherMatterNorSeenThrough) {
  // An arm of 6 cm in front of the wall; the mask knows it 2 cm too deep.
  scenes::Simulated with_arm({placed(geometry::make_box({0.1, 3.0, 3.0}), {0.25, 0.0, 0.0}),
                              placed(geometry::make_box({0.06, 0.06, 0.1}), {0.08, 0.0, 0.0})},
                             scenes::depth_camera(2), kFromAside);
  scenes::Simulated arm({placed(geometry::make_box({0.06, 0.06, 0.1}), {0.1, 0.0, 0.0})},
                        scenes::depth_camera(2), kFromAside);
  std::vector<float> arm_depth_m;
  for (const SeenPixel& pixel : arm.seen()) arm_depth_m.push_back(pixel.depth_m);
  const auto arm_voxels = [](const Fusion& fusion) {
    std::size_t count = 0;
    VoxelBox{{0, 0, 0}, {30, 64, 64}}.for_each([&](Index3 v) { count += fusion.occupied().get(v) ? 1 : 0; });
    return count;
  };
  Fusion blind = fused(small_fusion(), with_arm.exact());
  EXPECT_GT(arm_voxels(blind), 200U);
  Fusion masked = Fusion::create(small_fusion()).value();
  for (int i = 0; i < 5; ++i) masked.integrate(with_arm.exact(), arm_depth_m);
  EXPECT_EQ(arm_voxels(masked), 0U);
  EXPECT_EQ(masked.weight({41, 32, 32}), 0);  // hidden by the arm
  EXPECT_GT(masked.weight({41, 10, 32}), 0);
  // Matter that was there stays while the arm hides it, though the mask lies before nothing but the wall.
  scenes::Simulated wall_alone = wall();
  Fusion seen_before = fused(small_fusion(), wall_alone.exact());
  const std::size_t before = seen_before.occupied().count();
  for (int i = 0; i < 20; ++i) seen_before.integrate(with_arm.exact(), arm_depth_m);
  EXPECT_EQ(seen_before.occupied().count(), before);
}

TEST(Fusion, WhatIsTakenAwayFromBeforeTheArmIsGoneWhileItStaysThere) {
  // A ball between the camera and an arm that fills the image behind it; both before the wall.
  const auto ball = placed(geometry::make_sphere(0.03), {0.05, 0.0, 0.0});
  const std::vector<CameraScene::Object> behind{
      placed(geometry::make_box({0.1, 3.0, 3.0}), {0.25, 0.0, 0.0}),
      placed(geometry::make_box({0.03, 0.3, 0.3}), {0.18, 0.0, 0.0})};
  scenes::Simulated arm({behind[1]}, scenes::depth_camera(2), kFromAside);
  std::vector<float> arm_depth_m;
  for (const SeenPixel& pixel : arm.seen()) arm_depth_m.push_back(pixel.depth_m);
  scenes::Simulated with_ball({behind[0], behind[1], ball}, scenes::depth_camera(2), kFromAside),
      without({behind[0], behind[1]}, scenes::depth_camera(2), kFromAside);
  Fusion fusion = Fusion::create(small_fusion()).value();
  for (int i = 0; i < 10; ++i) fusion.integrate(with_ball.exact(), arm_depth_m);
  EXPECT_GT(fusion.occupied().count(), 200U);
  for (int i = 0; i < 10; ++i) fusion.integrate(without.exact(), arm_depth_m);
  EXPECT_EQ(fusion.occupied().count(), 0U) << "neither the ball nor the arm";
  // A sensor that measures nothing at the place of the arm says nothing of what is before it.
  Fusion dark = Fusion::create(small_fusion()).value();
  for (int i = 0; i < 10; ++i) dark.integrate(with_ball.exact(), arm_depth_m);
  std::vector<float> hole(without.exact().depth_m().begin(), without.exact().depth_m().end());
  for (std::size_t i = 0; i < hole.size(); ++i) hole[i] = arm_depth_m[i] > 0.0F ? 0.0F : hole[i];
  DepthImage unmeasured;
  ASSERT_TRUE(unmeasured.load_m(without.header(), hole));
  for (int i = 0; i < 10; ++i) dark.integrate(unmeasured, arm_depth_m);
  EXPECT_GT(dark.occupied().count(), 200U);
}

TEST(Fusion, MemoryIsBoundedAndNothingIsAllocatedAfterTheFirstImage) {
  FusionParameters parameters = small_fusion();
  scenes::Simulated camera = wall(), nearer = wall(0.1);
  const DepthImage first = camera.exact(), second = nearer.exact();
  const std::vector<float> arm_depth_m(first.camera().pixels(), 0.0F);
  Fusion fusion = Fusion::create(parameters).value();
  fusion.integrate(first, arm_depth_m);
  const std::size_t bytes = fusion.bytes();
  {
    const test::HeapGuard guard;
    for (int i = 0; i < 40; ++i) {
      fusion.integrate(i / 10 % 2 == 0 ? second : first, arm_depth_m);
      fusion.clear_changes();
    }
  }
  EXPECT_EQ(fusion.bytes(), bytes);
  parameters.max_blocks = 20;
  Fusion few = Fusion::create(parameters).value();
  const FusionReport report = few.integrate(first);
  EXPECT_EQ(report.blocks, 20U);
  EXPECT_GT(report.refused, 0U);
}

TEST(Fusion, BlocksWithoutASurfaceAreReleased) {
  scenes::Simulated camera = wall(), away = wall(0.9);
  Fusion fusion = fused(small_fusion(), camera.exact());
  EXPECT_GT(fusion.occupied().count(), 1000U);
  for (int i = 0; i < 20; ++i) fusion.integrate(away.exact());
  EXPECT_EQ(fusion.occupied().count(), 0U);
  EXPECT_LT(fusion.integrate(away.exact()).blocks, 90U);  // those beyond the image's border remain
}

TEST(Fusion, RefusesEachAbsurdParameter) {
  struct Fault {
    const char* names;
    void (*make)(FusionParameters&);
  };
  const Fault faults[] = {
      {"0 x 64 x 64", [](FusionParameters& p) { p.grid.size_vox[0] = 0; }},
      {"of 16384000000 voxels",
       [](FusionParameters& p) {
         p.grid.size_vox = {16000, 16000, 64};
       }},
      {"no cubes",
       [](FusionParameters& p) {
         p.grid.voxel_size_m = workspace::VoxelSize({0.005, 0.005, 0.006});
       }},
      {"corner is nan", [](FusionParameters& p) { p.grid.origin_m.x() = NAN; }},
      {"truncation_vox is 17", [](FusionParameters& p) { p.truncation_vox = 17.0; }},
      {"truncation_vox is nan", [](FusionParameters& p) { p.truncation_vox = NAN; }},
      {"shell_vox is 4", [](FusionParameters& p) { p.shell_vox = 4.0; }},
      {"hysteresis_vox is 2", [](FusionParameters& p) { p.hysteresis_vox = 2.0; }},
      {"max_weight is 256", [](FusionParameters& p) { p.max_weight = 256; }},
      {"sigma.at_1m_m is -1", [](FusionParameters& p) { p.sigma.at_1m_m = -1.0; }},
      {"min_component_vox is 65", [](FusionParameters& p) { p.min_component_vox = 65; }},
      {"max_blocks is 0", [](FusionParameters& p) { p.max_blocks = 0; }},
      {"arm_margin_px is 65", [](FusionParameters& p) { p.masks.arm_margin_px = 65; }},
      {"unknown_regions is 1001", [](FusionParameters& p) { p.unknown_regions.resize(1001); }}};
  for (const Fault& fault : faults) {
    FusionParameters parameters = small_fusion();
    fault.make(parameters);
    const core::Status status = Fusion::create(parameters).status();
    EXPECT_THAT(status.message(),
                testing::AllOf(testing::HasSubstr(fault.names), testing::HasSubstr("allowed")));
  }
}

}  // namespace
}  // namespace phantom::fusion

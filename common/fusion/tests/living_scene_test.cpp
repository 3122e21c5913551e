// A noisy camera over a cell: what is still stays, what comes and goes is published in time, surfaces are
// true.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <set>

#include "common/fusion/fusion.hpp"
#include "common/fusion/tests/scenes.hpp"
#include "common/fusion/tests/surface_errors.hpp"
#include "common/workspace/workspace.hpp"
#include "tests/support/thorough.hpp"

namespace phantom::fusion {
namespace {

using scenes::placed;
using workspace::Index3;
using workspace::VoxelBox;

std::size_t changed_bricks(const Fusion& fusion) {
  std::set<Index3> bricks;
  for (const Index3 block : fusion.changed_blocks()) bricks.insert(workspace::brick_of(kBlockEdge * block));
  return bricks.size();
}

Fusion cell_fusion() {
  FusionParameters parameters;
  parameters.grid = scenes::cell_grid();
  return Fusion::create(parameters).value();
}

constexpr std::uint64_t kSettled = 100;  // frames

/// Bricks that change in each frame of a still scene once it has settled.
std::vector<std::size_t> still_bricks(const DepthNoise& noise, std::uint64_t frames, std::size_t& voxels) {
  scenes::Simulated camera(scenes::cell_objects(), scenes::depth_camera(2), scenes::cell_camera(), noise);
  Fusion fusion = cell_fusion();
  std::vector<std::size_t> bricks;
  voxels = 0;
  for (std::uint64_t i = 0; i < frames; ++i) {
    fusion.clear_changes();
    const FusionReport& report = fusion.integrate(camera.frame(i));
    EXPECT_EQ(report.refused, 0U);
    if (i < kSettled) continue;
    bricks.push_back(changed_bricks(fusion));
    voxels += report.changes.appeared + report.changes.vanished;
  }
  return bricks;
}

double mean_of(const std::vector<std::size_t>& values) {
  double sum = 0.0;
  for (const std::size_t value : values) sum += static_cast<double>(value);
  return sum / static_cast<double>(values.size());
}

TEST(LivingScene, AStillSceneStays) {
  DepthNoise sensor;  // the sensor's errors, without what steel mirrors: that looks like matter to any camera
  sensor.steel_mirrored = 0.0;
  std::size_t voxels = 0;
  const std::vector<std::size_t> bricks = still_bricks(sensor, test::thorough_or(300, 1200), voxels);
  EXPECT_LE(mean_of(bricks), 3.0);
  const auto above = std::count_if(bricks.begin(), bricks.end(), [](std::size_t count) { return count > 5; });
  EXPECT_LE(above, static_cast<std::ptrdiff_t>(bricks.size() / 20));
  std::printf("still scene: %.2f bricks a frame, %.1f voxels, most %zu bricks\n", mean_of(bricks),
              static_cast<double>(voxels) / static_cast<double>(bricks.size()),
              *std::max_element(bricks.begin(), bricks.end()));
}

TEST(LivingScene, MirroringSteelChangesFewBricks) {
  std::size_t voxels = 0;
  const std::vector<std::size_t> bricks = still_bricks({}, test::thorough_or(200, 600), voxels);
  EXPECT_LE(mean_of(bricks), 8.0);
}

/// A floor, and a box that comes and goes.
class PutAndRemoved : public testing::Test {
 protected:
  static constexpr double kEye_m = 1.0;
  const std::vector<CameraScene::Object> floor{placed(geometry::make_box({3, 3, 0.1}), {0, 0, 0.05})};
  const CameraScene::Object box = placed(geometry::make_box({0.12, 0.1, 0.1}), {0, 0, 0.15});
  const geometry::Pose X_WC = scenes::looking_at({0.05, -0.4, 0.1 + kEye_m}, {0, 0, 0.1});
  scenes::Simulated empty{floor, scenes::depth_camera(2), X_WC};
  scenes::Simulated full{{floor[0], box}, scenes::depth_camera(2), X_WC};
  std::uint64_t number = 0;

  Fusion fusion = Fusion::create(parameters()).value();
  static FusionParameters parameters() {
    FusionParameters p;
    p.grid = {{-0.3, -0.3, 0.0}, 0.005, {120, 120, 80}};
    p.max_blocks = 3000;
    return p;
  }
  void show(scenes::Simulated& scene, int frames) {
    for (int i = 0; i < frames; ++i) fusion.integrate(scene.frame(number++));
  }
  /// Voxels of the box's visible top, a layer below its surface, and what is published there.
  double share_of_top() const {
    std::size_t count = 0, all = 0;
    VoxelBox{{50, 52, 38}, {20, 16, 1}}.for_each([&](Index3 v) {
      ++all;
      count += fusion.occupied().get(v) ? 1 : 0;
    });
    return static_cast<double>(count) / static_cast<double>(all);
  }
  std::size_t above_floor() const {
    std::size_t count = 0;
    VoxelBox{{0, 0, 22}, {120, 120, 58}}.for_each(
        [&](Index3 v) { count += fusion.occupied().get(v) ? 1 : 0; });
    return count;
  }
};

TEST_F(PutAndRemoved, SettledBlocksAreLeftOutUntilSomethingChangesThere) {
  show(empty, 100);
  const FusionReport settled = fusion.integrate(empty.frame(number++));
  EXPECT_GT(2 * settled.quiet, settled.fused);
  const FusionReport changed = fusion.integrate(full.frame(number++));
  EXPECT_GT(changed.fused, settled.fused);
  show(full, 1);
  EXPECT_GT(share_of_top(), 0.9) << "with the second frame, as everywhere";
  // A camera that moves has nothing to compare with.
  scenes::Simulated moved(floor, scenes::depth_camera(2),
                          scenes::looking_at({0.06, -0.4, 0.1 + kEye_m}, {0, 0, 0.1}));
  EXPECT_EQ(fusion.integrate(moved.frame(number++)).quiet, 0U);
}

TEST_F(PutAndRemoved, NewMatterIsPublishedWithTheSecondFrame) {
  show(empty, 100);
  EXPECT_EQ(above_floor(), 0U);
  show(full, 1);
  EXPECT_EQ(above_floor(), 0U);
  show(full, 1);
  EXPECT_GT(share_of_top(), 0.9);
}

TEST_F(PutAndRemoved, VacatedSpaceIsFreeWithTheThirdFrame) {
  show(full, 150);  // weights are full
  const std::size_t there = above_floor();
  EXPECT_GT(there, 1000U);
  show(empty, 2);
  EXPECT_GT(above_floor(), there * 9 / 10);
  show(empty, 1);
  EXPECT_LT(above_floor(), there / 50);
  show(empty, 70);
  EXPECT_EQ(above_floor(), 0U);
}

TEST_F(PutAndRemoved, AnObjectThatIsShownForOneFrameIsNeverPublished) {
  show(empty, 60);
  for (int i = 0; i < 10; ++i) {
    show(full, 1);
    show(empty, 4);
    EXPECT_EQ(above_floor(), 0U);
  }
}

TEST_F(PutAndRemoved, ThePublishedSurfaceIsWithinAVoxelOfTheFusedOne) {
  show(full, 150);
  std::size_t checked = 0, beyond = 0;  // changes of a few voxels wait for their turn
  VoxelBox{{1, 1, 1}, {118, 118, 78}}.for_each([&](Index3 v) {
    if (fusion.weight(v) < 100) return;
    const double d = fusion.distance_vox(v);
    const bool in_shell = d < -1.0 && d > -2.0;
    if (!in_shell && d < 1.0) return;
    ++checked;
    if (fusion.occupied().get(v) != in_shell) ++beyond;
  });
  EXPECT_GT(checked, 5000U);
  EXPECT_LE(beyond, checked / 1000);
}

TEST_F(PutAndRemoved, SurfacesAreTrue) {
  show(full, 30);
  const scenes::SurfaceErrors errors(fusion, full.scene(), {{1, 1, 1}, {118, 118, 78}});
  ASSERT_GT(errors.count(), 10000U);
  EXPECT_LT(errors.mean_m(), 0.0025);
  EXPECT_LT(errors.percentile_m(95), 0.006);
}

TEST(LivingScene, ARodOfTenMillimetresIsPublishedWithinFiveFrames) {
  const CameraScene::Object back = placed(geometry::make_box({3.0, 0.1, 3.0}), {0.0, 1.2, 0.5});
  FusionParameters parameters;
  parameters.grid = {{-0.3, 0.0, 0.0}, 0.005, {120, 120, 120}};
  parameters.max_blocks = 3000;
  for (const double x_m : {0.02, 0.0212, 0.0225, 0.0237}) {  // however it stands to voxels and pixels
    const CameraScene::Object rod = placed(geometry::make_cylinder(0.005, 0.5), {x_m, 0.3, 0.3});
    scenes::Simulated camera({back, rod}, scenes::depth_camera(),
                             scenes::looking_at({0, -1.2, 0.3}, {0, 1, 0.3}));
    Fusion fusion = Fusion::create(parameters).value();
    for (std::uint64_t i = 0; i < 5; ++i) fusion.integrate(camera.frame(i));
    int slices = 0;
    for (std::int32_t z = 20; z < 100; ++z) {
      bool found = false;
      VoxelBox{{61, 57, z}, {8, 8, 1}}.for_each([&](Index3 v) { found = found || fusion.occupied().get(v); });
      slices += found ? 1 : 0;
    }
    EXPECT_GT(slices, 72) << x_m;
    // Matter stands nowhere else in front of the wall.
    std::size_t beside = 0;
    VoxelBox{{0, 0, 0}, {120, 110, 120}}.for_each([&](Index3 v) {
      const bool near = std::abs(v.x - 64) <= 5 && std::abs(v.y - 60) <= 6;
      beside += !near && fusion.occupied().get(v) ? 1 : 0;
    });
    EXPECT_EQ(beside, 0U) << x_m;
  }
}

}  // namespace
}  // namespace phantom::fusion

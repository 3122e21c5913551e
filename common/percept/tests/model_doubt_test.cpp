#include "common/percept/model_doubt.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "common/percept/near_surface.hpp"
#include "tests/support/heap_guard.hpp"

namespace phantom::percept::model_doubt_test {
namespace {

constexpr double kTick_s = 0.001;

DoubtEvidence force_at(double x_m, std::uint32_t link = 3) {
  return {.kind = DoubtKind::kForceInFreeSpace,
          .link = link,
          .position_W_m = {x_m, 0.0, 0.5},
          .located = true,
          .force_N = 12.0,
          .object = 0,
          .residual_m = std::nan("")};
}
DoubtEvidence inside() {
  return {.kind = DoubtKind::kNoForceInside, .link = 2, .object = 4, .residual_m = -0.03};
}

struct Told {
  ModelDoubtMonitor monitor;
  std::vector<ModelDoubt> raised, ended;

  void step(const std::vector<DoubtEvidence>& evidence, double seconds) {
    for (double passed_s = 0.0; passed_s < seconds - 0.5 * kTick_s; passed_s += kTick_s) {
      ModelDoubtMonitor::Changes changes;
      monitor.step(evidence, kTick_s, changes);
      raised.insert(raised.end(), changes.raised.begin(), changes.raised.end());
      ended.insert(ended.end(), changes.ended.begin(), changes.ended.end());
    }
  }
};

TEST(ModelDoubt, AForceThatLastsIsOneDoubtAtThePlaceWhereItBegan) {
  Told told;
  told.step({force_at(0.10)}, 0.03);
  EXPECT_TRUE(told.raised.empty()) << "it may be an impact's noise";
  told.step({force_at(0.12)}, 0.03);  // it slides
  ASSERT_EQ(told.raised.size(), 1U);
  EXPECT_EQ(told.raised[0].number, 1U);
  EXPECT_DOUBLE_EQ(told.raised[0].at.position_W_m.x(), 0.10);
  EXPECT_TRUE(told.monitor.holds());
  told.step({force_at(0.11)}, 2.0);
  EXPECT_EQ(told.raised.size(), 1U);
  EXPECT_TRUE(told.ended.empty());
}

TEST(ModelDoubt, ABriefPauseEndsNoneAndALongOneDoes) {
  Told told;
  told.step({force_at(0.10)}, 0.1);
  told.step({}, 0.25);
  told.step({force_at(0.10)}, 0.1);
  told.step({}, 0.25);
  EXPECT_TRUE(told.ended.empty());
  EXPECT_EQ(told.raised.size(), 1U);
  told.step({}, 0.1);
  ASSERT_EQ(told.ended.size(), 1U);
  EXPECT_EQ(told.ended[0].number, 1U);
  EXPECT_FALSE(told.monitor.holds());
  told.step({force_at(0.10)}, 0.1);
  ASSERT_EQ(told.raised.size(), 2U);
  EXPECT_EQ(told.raised[1].number, 2U);
  EXPECT_EQ(told.raised[1].place, told.raised[0].place) << "the same place is kept once";
}

TEST(ModelDoubt, EvidenceElsewhereIsAnotherDoubtInAPlaceOfItsOwn) {
  Told told;
  told.step({force_at(0.10)}, 0.1);
  told.step({force_at(0.20)}, 0.3);
  EXPECT_EQ(told.raised.size(), 1U) << "an arm that slides along something raises not too many";
  told.step({force_at(0.20)}, 0.3);
  told.step({force_at(0.20, 5)}, 0.6);
  ASSERT_EQ(told.raised.size(), 3U);
  ASSERT_EQ(told.ended.size(), 2U) << "one of a kind holds at a time";
  EXPECT_EQ(told.ended[0].number, 1U);
  EXPECT_NE(told.raised[0].place, told.raised[1].place);
  EXPECT_NE(told.raised[1].place, told.raised[2].place);
}

TEST(ModelDoubt, TheNewestPlacesAreKept) {
  Told told;
  for (int i = 0; i < 20; ++i) told.step({force_at(0.1 * i)}, 0.6);
  ASSERT_EQ(told.raised.size(), 20U);
  for (std::size_t i = 0; i < 20; ++i) EXPECT_EQ(told.raised[i].place, i % ModelDoubtMonitor::kPlaces);
  told.step({force_at(0.0)}, 0.6);  // its place was taken by a newer one's
  EXPECT_EQ(told.raised.back().place, 4U);
}

TEST(ModelDoubt, RestWithoutAForceCountsLongerAndBesideAForceElsewhere) {
  Told told;
  told.step({inside()}, 0.4);
  EXPECT_TRUE(told.raised.empty());
  told.step({force_at(0.1), inside()}, 0.2);
  ASSERT_EQ(told.raised.size(), 2U);
  EXPECT_EQ(told.raised[1].at.kind, DoubtKind::kNoForceInside);
  EXPECT_DOUBLE_EQ(told.raised[1].at.residual_m, -0.03);
  ModelDoubtMonitor::Changes changes;
  told.monitor.close(changes);
  EXPECT_EQ(changes.ended.size(), 2U);
  EXPECT_FALSE(told.monitor.holds());
}

TEST(ModelDoubt, ATimeThatIsNoneRaisesNothingAndAStepUsesNoHeap) {
  ModelDoubtMonitor monitor;
  ModelDoubtMonitor::Changes changes;
  const std::array evidence{force_at(0.1)};
  const test::HeapGuard guard;
  for (int i = 0; i < 100; ++i) {
    monitor.step(evidence, std::numeric_limits<double>::quiet_NaN(), changes);
    monitor.step(evidence, -1.0, changes);
  }
  EXPECT_TRUE(changes.empty());
  for (int i = 0; i < 100; ++i) monitor.step(evidence, kTick_s, changes);
  EXPECT_EQ(changes.raised.size(), 1U);
}

constexpr double kVoxel_m = 0.005;

/// A body in 0.05…0.10 m of each axis of (0.16 m)³, a guard of one voxel below it.
workspace::Workspace block() {
  workspace::GridSpec grid{Eigen::Vector3d(-0.04, 0.0, 0.0), kVoxel_m, {32, 32, 32}};
  workspace::Workspace voxels(grid, {0.0F, 20.0F, 100.0F});
  for (std::int32_t z = 9; z < 20; ++z)
    for (std::int32_t y = 10; y < 20; ++y)
      for (std::int32_t x = 10; x < 20; ++x) {
        const auto brick = voxels.edit_brick(workspace::brick_of({x, y, z}));
        const std::size_t at = workspace::brick_offset(workspace::Index3{x, y, z});
        brick.mu_code[at] = 2;
        brick.order[at] = z == 9 ? workspace::kOrderGuard : workspace::kOrderBoundary;
        brick.object[at] = 7;
      }
  return voxels;
}
const Eigen::Vector3d kBlockMiddle_m(0.035, 0.075, 0.075);

TEST(NearSurface, IsTheDistanceToTheNearestVoxelOfABodyOrItsGuard) {
  const workspace::Workspace voxels = block();
  const auto above = near_surface(voxels, kBlockMiddle_m + Eigen::Vector3d(0.0, 0.0, 0.025 + 0.012), 0.02);
  ASSERT_TRUE(above.found);
  EXPECT_NEAR(above.distance_m, 0.012, 1e-9);
  EXPECT_EQ(above.object, 7);
  const auto below = near_surface(voxels, kBlockMiddle_m - Eigen::Vector3d(0.0, 0.0, 0.025 + 0.012), 0.02);
  EXPECT_NEAR(below.distance_m, 0.007, 1e-9) << "a guard counts: the body may be there";
  const auto corner =
      near_surface(voxels, kBlockMiddle_m + Eigen::Vector3d(0.025 + 0.003, 0.025 + 0.004, 0.025), 0.02);
  EXPECT_NEAR(corner.distance_m, 0.005, 1e-9);
  EXPECT_FALSE(near_surface(voxels, kBlockMiddle_m + Eigen::Vector3d(0.0, 0.0, 0.046), 0.02).found);
  EXPECT_FALSE(near_surface(voxels, Eigen::Vector3d::Constant(std::nan("")), 0.02).found);
  EXPECT_FALSE(near_surface(voxels, {50.0, 0.0, 0.0}, 0.02).found) << "nothing is outside the grid";
  EXPECT_DOUBLE_EQ(near_surface(voxels, kBlockMiddle_m, 0.02).distance_m, 0.0);
}

TEST(NearSurface, TheWayOutLeavesTheGuardOut) {
  const workspace::Workspace voxels = block();
  const auto depth_m = [&](double below_m, double radius_m) {
    const NearVoxel out = near_free(voxels, kBlockMiddle_m - Eigen::Vector3d(0.0, 0.0, below_m), radius_m);
    return out.found ? out.distance_m : -1.0;
  };
  EXPECT_NEAR(depth_m(0.0, 0.04), 0.025, 1e-9);
  EXPECT_EQ(depth_m(0.0, 0.01), -1.0) << "no farther is looked";
  EXPECT_NEAR(depth_m(0.02, 0.04), 0.005, 1e-9);
  EXPECT_EQ(depth_m(0.027, 0.04), 0.0);
}

}  // namespace
}  // namespace phantom::percept::model_doubt_test

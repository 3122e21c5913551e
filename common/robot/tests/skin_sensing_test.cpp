#include "common/robot/sensing/skin_sensing.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <random>

#include "common/robot/tests/test_arms.hpp"
#include "common/robot/tests/test_worlds.hpp"
#include "tests/support/heap_guard.hpp"

namespace phantom::robot::skin_sensing_test {
namespace {

using core::JointArray;

SkinLayout layout_of(const SerialArm& arm) {
  return *lay_out_skin(arm, test_worlds::tubes(), {.voxel_size_m = 0.01});
}

/// Tubes, and on the third link an axis of clusters.
SkinLayout with_clusters(const SerialArm& arm) {
  std::vector<LinkSkin> skin = test_worlds::tubes();
  AxisSensors axis;
  axis.to_m = {0.0, 0.0, -0.2};
  axis.radius_m = 0.03;
  axis.cluster = ClusterSpec{2, ClusterShape::kSphere};
  skin[2].axes.push_back(axis);
  return *lay_out_skin(arm, skin, {.voxel_size_m = 0.01});
}

/// Returns where the links stand at random joint angles.
LinkPoses any_pose(const SerialArm& arm, std::mt19937& random) {
  JointArray q{};
  for (std::size_t i = 0; i < 7; ++i)
    q[i] = std::uniform_real_distribution(arm.joints()[i].lower, arm.joints()[i].upper)(random);
  LinkPoses X_WL;
  arm.link_poses(q, X_WL);
  return X_WL;
}

TEST(SkinSensing, FindsTheGreatestViscosityAndWhoMeetsIt) {
  const SerialArm arm = test_arms::suspended();
  const SkinLayout layout = layout_of(arm);
  const workspace::Workspace world = test_worlds::balls();
  SkinSensing sensing(layout, {});
  std::mt19937 random(1);
  int found = 0;
  for (int trial = 0; trial < 30; ++trial) {
    const LinkPoses X_WL = any_pose(arm, random);
    sensing.sense(X_WL, 7, world);
    float greatest = 0.0F;
    std::size_t active = 0;
    for (std::size_t s = 0; s < layout.size(); ++s) {
      const float mu = world.mu(world.grid().index_of(X_WL[layout.link_of(s)] * layout.position(s)));
      greatest = std::max(greatest, mu);
      active += mu > 0.0F ? 1U : 0U;
    }
    EXPECT_EQ(sensing.active(), active);
    const WorstSensor& worst = sensing.worst();
    ASSERT_EQ(worst.found, greatest > 0.0F);
    if (!worst.found) continue;
    ++found;
    EXPECT_EQ(worst.mu, greatest);
    EXPECT_EQ(worst.link, layout.link_of(worst.sensor));
    EXPECT_TRUE(worst.position_W_m.isApprox(X_WL[worst.link] * layout.position(worst.sensor)));
    EXPECT_EQ(world.mu(worst.voxel), greatest);
    EXPECT_EQ(worst.order, world.order(worst.voxel));
    EXPECT_EQ(worst.object, 1);
  }
  EXPECT_GT(found, 10);
}

/// Sums over the sensors of a link one by one, of what the workspace holds at their places.
ViscousSums literal_sums(const SkinLayout& layout, const LinkPoses& X_WL, std::size_t link,
                         const workspace::Workspace& world, int reach) {
  ViscousSums sums;
  const Eigen::Vector3d& sides_m = world.grid().voxel_size_m.sides_m();
  const ClusterStencil zone(ClusterSpec{2, ClusterShape::kSphere});
  for (std::size_t s = layout.first[link]; s < layout.first[link + 1]; ++s) {
    const Eigen::Vector3d d_m = X_WL[link].rotation * layout.position(s);
    const workspace::Index3 v = world.grid().index_of(X_WL[link].translation_m + d_m);
    double mu = world.mu(v);
    if (layout.cluster_kind[s] != 0) {
      mu = 0.0;
      zone.for_each(v, [&](workspace::Index3 at, double w) { mu += w * world.mu(at) / zone.total_weight(); });
    }
    if (mu == 0.0) continue;
    const double w = layout.weight[s];
    sums.mu += w * mu;
    sums.mu_d += w * mu * d_m;
    sums.mu_dd += w * mu * d_m * d_m.transpose();
    Eigen::Vector3d slope;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      workspace::Index3 step{};
      step[axis] = reach;
      const auto i = static_cast<Eigen::Index>(axis);
      slope[i] = (world.mu(v + step) - world.mu(v - step)) / (2.0 * reach * sides_m[i]);
    }
    sums.gradient += w * slope;
    sums.gradient_moment += w * d_m.cross(slope);
    sums.gradient_square += w * slope.squaredNorm() / mu;
  }
  return sums;
}

TEST(SkinSensing, FeelsInVoxelsThatAreNoCubesWhatTheyHoldAndItsSlopeInMetres) {
  const SerialArm arm = test_arms::suspended();
  const SkinLayout layout = with_clusters(arm);
  for (const Eigen::Vector3d& sides_m : {Eigen::Vector3d(0.01, 0.01, 0.01), Eigen::Vector3d(0.01, 0.01, 0.02),
                                         Eigen::Vector3d(0.02, 0.015, 0.011)}) {
    const workspace::Workspace world = test_worlds::balls_in(workspace::VoxelSize(sides_m));
    SkinSensing sensing(layout, {.gradient = true, .gradient_reach_vox = 3});
    std::mt19937 random(5);
    int felt = 0;
    for (int trial = 0; trial < 20; ++trial) {
      const LinkPoses X_WL = any_pose(arm, random);
      sensing.sense(X_WL, 7, world);
      for (std::size_t link = 1; link <= 7; ++link) {
        const ViscousSums expected = literal_sums(layout, X_WL, link, world, 3), &got = sensing.sums()[link];
        felt += expected.mu > 0.0 ? 1 : 0;
        EXPECT_NEAR(got.mu, expected.mu, 1e-9 * expected.mu);
        EXPECT_LT((got.mu_d - expected.mu_d).norm(), 1e-9 * (expected.mu + 1e-9));
        EXPECT_LT((got.mu_dd - expected.mu_dd).norm(), 1e-9 * (expected.mu + 1e-9));
        const double scale = 1e-9 * (std::abs(expected.gradient_square) + expected.gradient.norm()) + 1e-12;
        EXPECT_LT((got.gradient - expected.gradient).norm(), scale);
        EXPECT_LT((got.gradient_moment - expected.gradient_moment).norm(), scale);
        EXPECT_NEAR(got.gradient_square, expected.gradient_square, scale);
      }
    }
    EXPECT_GT(felt, 20);
  }
}

TEST(SkinSensing, AmongEqualsTakesTheOneNearestToTheObject) {
  // A floor below a horizontal tube: the whole underside is in one layer, its lowest line is the nearest.
  const SerialArm arm = test_arms::planar(test_arms::at(-0.3, 0.0, 0.5));
  SkinSegment tube;
  tube.to_m = {0.4, 0.0, 0.0};
  tube.from_radius_m = tube.to_radius_m = 0.05;
  const SkinLayout layout = *lay_out_skin(arm, {{"upper", {tube}}}, {.voxel_size_m = 0.01});
  const workspace::Workspace world =
      test_worlds::make([](const Eigen::Vector3d& p) { return test_worlds::layer_code(p.z() - 0.35, 0.04); });
  SkinSensing sensing(layout, {});
  LinkPoses X_WL;
  arm.link_poses({}, X_WL);
  sensing.sense(X_WL, 2, world);
  ASSERT_TRUE(sensing.worst().found);
  EXPECT_LT(sensing.worst().position_W_m.z(), 0.46);
}

TEST(SkinSensing, OutsideTheGridIsFreeSpace) {
  const SerialArm arm = test_arms::suspended(test_arms::at(50.0, -80.0, 3.0));
  const SkinLayout layout = layout_of(arm);
  const workspace::Workspace world =
      test_worlds::make([](const Eigen::Vector3d&) { return std::uint8_t{5}; }, {0, 0, 1}, 0.04);
  SkinSensing sensing(layout, {.gradient = true});
  LinkPoses X_WL;
  arm.link_poses({}, X_WL);
  sensing.sense(X_WL, 7, world);
  EXPECT_FALSE(sensing.worst().found);
  EXPECT_EQ(sensing.active(), 0U);
  for (const ViscousSums& sums : sensing.sums()) EXPECT_EQ(sums.mu, 0.0);
}

TEST(SkinSensing, SensorsThatStickOutOfTheGridCountOnlyInside) {
  // The grid ends in the middle of the arm; every voxel in it is fluid.
  const SerialArm arm = test_arms::suspended(test_arms::at(0.0, 0.0, 0.4));
  const SkinLayout layout = layout_of(arm);
  const workspace::Workspace world =
      test_worlds::make([](const Eigen::Vector3d&) { return std::uint8_t{5}; }, {0, 0, 1.2}, 0.04);
  SkinSensing sensing(layout, {});
  LinkPoses X_WL;
  arm.link_poses({}, X_WL);
  sensing.sense(X_WL, 7, world);
  std::size_t inside = 0;
  for (std::size_t s = 0; s < layout.size(); ++s) {
    inside +=
        world.grid().contains(world.grid().index_of(X_WL[layout.link_of(s)] * layout.position(s))) ? 1U : 0U;
  }
  EXPECT_EQ(sensing.active(), inside);
  EXPECT_GT(inside, 0U);
  EXPECT_LT(inside, layout.size());
}

TEST(SkinSensing, ALinkWhosePoseIsNotFiniteFeelsNothing) {
  const SerialArm arm = test_arms::suspended();
  const SkinLayout layout = layout_of(arm);
  const workspace::Workspace world =
      test_worlds::make([](const Eigen::Vector3d&) { return std::uint8_t{5}; });
  SkinSensing sensing(layout, {.gradient = true});
  LinkPoses X_WL;
  arm.link_poses({}, X_WL);
  sensing.sense(X_WL, 7, world);
  const LinkSums whole = sensing.sums();
  ASSERT_GT(whole[2].mu, 0.0);
  for (const double bad : {std::nan(""), HUGE_VAL, 1e300}) {
    for (const bool turned : {false, true}) {
      LinkPoses broken = X_WL;
      (turned ? broken[2].rotation(1, 0) : broken[2].translation_m.x()) = bad;
      sensing.sense(broken, 7, world);
      if (turned && bad == 1e300)
        continue;  // finite, though no rotation: it only must not read out of bounds
      EXPECT_EQ(sensing.sums()[2].mu, 0.0) << bad;
      EXPECT_EQ(sensing.sums()[3].mu, whole[3].mu) << bad;
    }
  }
}

TEST(SkinSensing, MutedObjectsAreNotFeltByThatLinkUntilTheyAreAgain) {
  const SerialArm arm = test_arms::suspended();
  const SkinLayout layout = with_clusters(arm);
  const workspace::Workspace world =
      test_worlds::make([](const Eigen::Vector3d&) { return std::uint8_t{5}; });  // all object 1
  SkinSensing sensing(layout, {});
  LinkPoses X_WL;
  arm.link_poses({}, X_WL);
  sensing.sense(X_WL, 7, world);
  const LinkSums whole = sensing.sums();
  const std::size_t active = sensing.active();
  EXPECT_EQ(sensing.muted(), 0U);

  ASSERT_TRUE(sensing.mute(3, 2, true));  // an object that is not there changes nothing
  sensing.sense(X_WL, 7, world);
  EXPECT_NEAR(sensing.sums()[3].mu, whole[3].mu, 1e-12 * whole[3].mu);

  ASSERT_TRUE(sensing.mute(3, 1, true));
  sensing.sense(X_WL, 7, world);
  EXPECT_EQ(sensing.sums()[3].mu, 0.0);
  EXPECT_EQ(sensing.sums()[2].mu, whole[2].mu);
  const std::size_t on_link = layout.first[4] - layout.first[3];
  EXPECT_EQ(sensing.muted(), on_link);
  EXPECT_EQ(sensing.active(), active - on_link);
  EXPECT_NE(sensing.worst().link, 3U);

  ASSERT_TRUE(sensing.mute(3, 1, false));
  ASSERT_TRUE(sensing.mute(3, 2, false));
  sensing.sense(X_WL, 7, world);
  EXPECT_EQ(sensing.sums()[3].mu, whole[3].mu);
  EXPECT_EQ(sensing.muted(), 0U);
  EXPECT_EQ(sensing.active(), active);

  for (std::uint16_t id = 1; id <= SkinSensing::kMaxMuted; ++id) EXPECT_TRUE(sensing.mute(3, id, true));
  EXPECT_FALSE(sensing.mute(3, SkinSensing::kMaxMuted + 1, true));
  EXPECT_TRUE(sensing.mute(3, 1, true)) << "muted already";
  EXPECT_FALSE(sensing.mute(100, 1, true));
}

/// Points in several parts a link, and clusters.
SkinLayout large_layout(const SerialArm& arm) {
  std::vector<LinkSkin> skin = test_worlds::tubes();
  AxisSensors axis;
  axis.to_m = {0.0, 0.0, -0.2};
  axis.radius_m = 0.03;
  axis.count = 150;
  axis.cluster = ClusterSpec{2, ClusterShape::kFraction};
  for (const std::size_t link : {1U, 3U, 6U}) skin[link].axes.push_back(axis);
  return *lay_out_skin(arm, skin, {.voxel_size_m = 0.01, .pitch_vox = 0.17});
}

void expect_same(const SkinSensing& a, const SkinSensing& b) {
  EXPECT_EQ(a.active(), b.active());
  EXPECT_EQ(a.muted(), b.muted());
  EXPECT_EQ(a.worst().found, b.worst().found);
  EXPECT_EQ(a.worst().sensor, b.worst().sensor);
  EXPECT_EQ(a.worst().mu, b.worst().mu);
  for (std::size_t link = 0; link <= core::kMaxJoints; ++link) {
    const ViscousSums &x = a.sums()[link], &y = b.sums()[link];
    EXPECT_EQ(x.mu, y.mu) << "link " << link;
    EXPECT_EQ(x.mu_d, y.mu_d) << "link " << link;
    EXPECT_EQ(x.mu_dd, y.mu_dd) << "link " << link;
    EXPECT_EQ(x.gradient, y.gradient) << "link " << link;
    EXPECT_EQ(x.gradient_moment, y.gradient_moment) << "link " << link;
    EXPECT_EQ(x.gradient_square, y.gradient_square) << "link " << link;
  }
}

TEST(SkinSensing, GivesTheSameBitForBitWithAnyNumberOfThreads) {
  const SerialArm arm = test_arms::suspended();
  const SkinLayout layout = large_layout(arm);
  ASSERT_GT(layout.size(), 50'000U);
  const workspace::Workspace world = test_worlds::balls();
  for (const bool slow : {false, true}) {
    SensingOptions options{.gradient = true};
    if (slow) options.memory = {1, 0.9, 0.75};
    SkinSensing alone(layout, options);
    if (slow) alone.mute(4, 1, true);
    std::vector<std::unique_ptr<SkinSensing>> shared;
    for (const std::size_t threads : {2U, 3U, 7U}) {
      options.threads = threads;
      shared.push_back(std::make_unique<SkinSensing>(layout, options));
      if (slow) shared.back()->mute(4, 1, true);
    }
    std::size_t met = 0;
    for (int step = 0; step < 20; ++step) {
      JointArray q{};
      for (std::size_t i = 0; i < 7; ++i) q[i] = 0.4 * std::sin(0.1 * step + static_cast<double>(i));
      LinkPoses X_WL;
      arm.link_poses(q, X_WL);
      alone.sense(X_WL, 7, world);
      met += alone.active();
      for (const auto& team : shared) {
        const test::HeapGuard guard;
        team->sense(X_WL, 7, world);
      }
      for (const auto& team : shared) expect_same(*team, alone);
    }
    EXPECT_GT(met, 1000U);
  }
}

TEST(SkinSensing, AnEmptyWorkspaceIsFreeSpace) {
  const SerialArm arm = test_arms::suspended();
  const SkinLayout layout = layout_of(arm);
  const workspace::Workspace nothing;
  SkinSensing sensing(layout, {.gradient = true});
  LinkPoses X_WL;
  arm.link_poses({}, X_WL);
  sensing.sense(X_WL, 7, nothing);
  EXPECT_FALSE(sensing.worst().found);
}

TEST(SkinSensing, RefiningTheSkinConvergesWhenWeightedByArea) {
  const SerialArm arm = test_arms::suspended();
  const workspace::Workspace world = test_worlds::balls();
  LinkPoses X_WL;
  arm.link_poses({0.1, 0.4, 0.9, -1.2, 0.2, 0.3, 0.1}, X_WL);
  std::vector<double> totals;
  for (const double pitch : {0.9, 0.45, 0.225}) {
    const SkinLayout layout =
        *lay_out_skin(arm, test_worlds::tubes(), {.voxel_size_m = 0.01, .pitch_vox = pitch});
    SkinSensing sensing(layout, {});
    sensing.sense(X_WL, 7, world);
    double total = 0.0;
    for (const auto& sums : sensing.sums()) total += sums.mu;
    totals.push_back(total);
  }
  ASSERT_GT(totals[2], 0.0);
  EXPECT_NEAR(totals[0], totals[2], 0.02 * totals[2]);
  EXPECT_NEAR(totals[1], totals[2], 0.01 * totals[2]);
}

}  // namespace
}  // namespace phantom::robot::skin_sensing_test

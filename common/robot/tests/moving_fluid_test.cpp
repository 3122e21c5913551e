// Fluid that moves with bodies: held to a literal twin, sensor by sensor.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <random>

#include "common/robot/sensing/skin_sensing.hpp"
#include "common/robot/tests/test_arms.hpp"
#include "common/robot/tests/test_worlds.hpp"
#include "tests/support/heap_guard.hpp"

namespace phantom::robot::moving_fluid_test {
namespace {

using core::JointArray;

/// A ball of fluid about the origin of its own frame, of other viscosities than the workspace's.
workspace::Workspace ball(double radius_m, float scale) {
  const int n = 40;
  workspace::GridSpec grid{Eigen::Vector3d::Constant(-0.2), 0.01, {n, n, n}};
  std::vector<float> palette = test_worlds::kPalette;
  for (float& mu : palette) mu *= scale;
  workspace::Workspace world(grid, palette);
  for (int z = 0; z < n; ++z)
    for (int y = 0; y < n; ++y)
      for (int x = 0; x < n; ++x) {
        const std::uint8_t code = test_worlds::layer_code(grid.centre_of({x, y, z}).norm() - radius_m, 0.025);
        if (code == 0) continue;
        const auto brick = world.edit_brick({x >> 5, y >> 5, z >> 5});
        const std::size_t at =
            workspace::brick_offset(static_cast<std::uint32_t>(x) & 31U, static_cast<std::uint32_t>(y) & 31U,
                                    static_cast<std::uint32_t>(z) & 31U);
        brick.mu_code[at] = code;
        brick.order[at] = 1;
        brick.object[at] = 900;
      }
  world.version = 1;
  return world;
}

struct Case {
  Normalisation normalisation = Normalisation::kArea;
  bool clusters = false, mutes = false;
  std::size_t threads = 1;
};

class MovingFluids : public testing::TestWithParam<Case> {
 protected:
  static SkinLayout layout(const SerialArm& arm) {
    auto parts = test_worlds::tubes();
    if (GetParam().clusters) parts[2].segments[0].cluster = ClusterSpec{2, ClusterShape::kSphere};
    return *lay_out_skin(arm, parts, {.voxel_size_m = 0.01, .normalisation = GetParam().normalisation});
  }
  LinkPoses random_pose() {
    JointArray q{};
    for (std::size_t i = 0; i < 7; ++i)
      q[i] = std::uniform_real_distribution(arm_.joints()[i].lower, arm_.joints()[i].upper)(random_);
    LinkPoses X_WL;
    arm_.link_poses(q, X_WL);
    return X_WL;
  }
  /// Places the balls near sensors of the arm, turned at random.
  std::vector<MovingFluid> random_fluids(const LinkPoses& X_WL) {
    std::normal_distribution<double> normal;
    std::vector<MovingFluid> fluids;
    for (const workspace::Workspace* voxels : {&small_, &large_, &small_}) {
      const std::size_t s = random_() % layout_.size();
      const Eigen::Vector3d near = X_WL[layout_.link_of(s)] * layout_.position(s);
      const Eigen::Vector3d turn(normal(random_), normal(random_), normal(random_));
      fluids.push_back({voxels,
                        {geometry::rotation_from_vector(turn),
                         near + 0.1 * Eigen::Vector3d(normal(random_), normal(random_), normal(random_))}});
    }
    return fluids;
  }

  std::mt19937 random_{11};
  SerialArm arm_ = test_arms::suspended(test_arms::at(0.0, 0.0, 1.5));
  SkinLayout layout_ = layout(arm_);
  workspace::Workspace world_ = test_worlds::balls(), small_ = ball(0.04, 1.5F), large_ = ball(0.08, 0.9F);
};

TEST_P(MovingFluids, AreFeltAsALiteralTwinFeelsThem) {
  SkinSensing sensing(layout_, {.threads = GetParam().threads, .moving_fluids = 3});
  if (GetParam().mutes) {
    for (std::size_t link = 3; link <= 6; ++link) sensing.mute(link, 900, true);
    sensing.mute(2, 1, true);
  }
  int overlapping = 0, felt_in_fluids = 0, worst_in_fluids = 0;
  for (int trial = 0; trial < 40; ++trial) {
    const LinkPoses X_WL = random_pose();
    const std::vector<MovingFluid> fluids = random_fluids(X_WL);
    {
      const test::HeapGuard guard;
      sensing.sense(X_WL, 7, world_, all_links(), fluids);
    }
    std::array<LinkSums, 4> twin{};
    std::array<std::size_t, core::kMaxJoints + 1> active{};
    float greatest = 0.0F;
    for (std::size_t s = 0; s < layout_.size(); ++s) {
      const std::size_t link = layout_.link_of(s);
      const Eigen::Vector3d p_W = X_WL[link] * layout_.position(s);
      double best = 0.0;
      std::size_t owner = 0;
      int meets = 0;
      for (std::size_t k = 0; k <= fluids.size(); ++k) {
        const workspace::Workspace& voxels = k == 0 ? world_ : *fluids[k - 1].voxels;
        const Eigen::Vector3d p = k == 0 ? p_W : fluids[k - 1].X_WB.inverse() * p_W;
        const bool silent = GetParam().mutes && ((k > 0 && link >= 3 && link <= 6) || (k == 0 && link == 2));
        const workspace::Index3 centre = voxels.grid().index_of(p);
        double mu = silent ? 0.0 : static_cast<double>(voxels.mu(centre));
        if (layout_.cluster_kind[s] != 0) {  // the mean of its ball of voxels
          double sum = 0.0, weight = 0.0;
          for (int z = -2; z <= 2; ++z)
            for (int y = -2; y <= 2; ++y)
              for (int x = -2; x <= 2; ++x) {
                if (x * x + y * y + z * z > 4) continue;
                sum +=
                    silent ? 0.0 : static_cast<double>(voxels.mu({centre.x + x, centre.y + y, centre.z + z}));
                weight += 1.0;
              }
          mu = sum / weight;
        } else if (!silent) {
          greatest = std::max(greatest, voxels.mu(centre));
        }
        meets += mu > 0.0 ? 1 : 0;
        if (mu > best) best = mu, owner = k;
      }
      overlapping += meets > 1 ? 1 : 0;
      if (best == 0.0) continue;
      ++active[link];
      ViscousSums& sums = twin[owner][link];
      const Eigen::Vector3d d = p_W - X_WL[link].translation_m;
      const double m = layout_.weight[s] * best;
      sums.mu += m;
      sums.mu_d += m * d;
      sums.mu_dd += m * d * d.transpose();
      felt_in_fluids += owner > 0 ? 1 : 0;
    }
    std::size_t all_active = 0;
    for (std::size_t link = 1; link <= 7; ++link) {
      all_active += active[link];
      ViscousSums total;
      for (std::size_t k = 0; k <= fluids.size(); ++k) {
        if (GetParam().normalisation == Normalisation::kActive && active[link] > 0)
          twin[k][link].scale(1.0 / static_cast<double>(active[link]));
        total.add(twin[k][link]);
        if (k == 0) continue;
        const ViscousSums& sums = sensing.sums_in(k - 1)[link];
        EXPECT_NEAR(sums.mu, twin[k][link].mu, 1e-9 * total.mu + 1e-15);
        EXPECT_LT((sums.mu_d - twin[k][link].mu_d).norm(), 1e-9 * total.mu + 1e-15);
        EXPECT_LT((sums.mu_dd - twin[k][link].mu_dd).norm(), 1e-9 * total.mu + 1e-15);
      }
      EXPECT_NEAR(sensing.sums()[link].mu, total.mu, 1e-9 * total.mu);
      EXPECT_LT((sensing.sums()[link].mu_dd - total.mu_dd).norm(), 1e-9 * total.mu + 1e-15);
    }
    EXPECT_EQ(sensing.active(), all_active);
    const WorstSensor& worst = sensing.worst();
    if (GetParam().clusters) continue;  // of a cluster the greatest in its zone counts
    ASSERT_EQ(worst.found, greatest > 0.0F);
    if (!worst.found) continue;
    EXPECT_EQ(worst.mu, greatest);
    EXPECT_TRUE(worst.position_W_m.isApprox(X_WL[worst.link] * layout_.position(worst.sensor)));
    const workspace::Workspace& voxels = worst.fluid == 0 ? world_ : *fluids[worst.fluid - 1].voxels;
    EXPECT_EQ(voxels.mu(worst.voxel), greatest);
    worst_in_fluids += worst.fluid > 0 ? 1 : 0;
  }
  EXPECT_GT(overlapping, 200);
  EXPECT_GT(felt_in_fluids, 1000);
  if (!GetParam().clusters) {
    EXPECT_GT(worst_in_fluids, 5);
  }
}

INSTANTIATE_TEST_SUITE_P(Every, MovingFluids,
                         testing::Values(Case{}, Case{.normalisation = Normalisation::kActive},
                                         Case{.clusters = true}, Case{.mutes = true}, Case{.threads = 3}));

TEST(MovingFluid, ThatIsFarAwayChangesNothingBitForBit) {
  const SerialArm arm = test_arms::suspended(test_arms::at(0.0, 0.0, 1.5));
  const SkinLayout layout = *lay_out_skin(arm, test_worlds::tubes(), {.voxel_size_m = 0.01});
  const workspace::Workspace world = test_worlds::balls(), far = ball(0.04, 1.0F);
  SkinSensing with(layout, {.gradient = true, .moving_fluids = 1}), without(layout, {.gradient = true});
  LinkPoses X_WL;
  arm.link_poses({0.1, 0.2, 0.3, 0.4, 0.1, 0.2, 0.3}, X_WL);
  const std::vector<MovingFluid> fluids{{&far, {Eigen::Matrix3d::Identity(), {5.0, 0.0, 0.0}}}};
  with.sense(X_WL, 7, world, all_links(), fluids);
  without.sense(X_WL, 7, world);
  for (std::size_t link = 1; link <= 7; ++link) {
    EXPECT_EQ(with.sums()[link].mu_dd, without.sums()[link].mu_dd);
    EXPECT_EQ(with.sums()[link].gradient_moment, without.sums()[link].gradient_moment);
    EXPECT_EQ(with.sums_in(0)[link].mu, 0.0);
  }
  EXPECT_EQ(with.worst().sensor, without.worst().sensor);
}

TEST(MovingFluid, AsTheOnlyFluidIsFeltAsTheSameVoxelsAtRest) {
  // The workspace is empty; the fluid is the one of the balls, in a frame of its own that is turned and moved
  // together with the arm.
  const SerialArm arm = test_arms::suspended(test_arms::at(0.0, 0.0, 1.5));
  const SkinLayout layout = *lay_out_skin(arm, test_worlds::tubes(), {.voxel_size_m = 0.01});
  const workspace::Workspace world = test_worlds::balls();
  const workspace::Workspace empty(world.grid(), {0.0F});
  SkinSensing moving(layout, {.gradient = true, .moving_fluids = 1}), still(layout, {.gradient = true});
  std::mt19937 random(2);
  for (int trial = 0; trial < 10; ++trial) {
    JointArray q{};
    for (std::size_t i = 0; i < 7; ++i)
      q[i] = std::uniform_real_distribution(arm.joints()[i].lower, arm.joints()[i].upper)(random);
    LinkPoses X_BL, X_WL;
    arm.link_poses(q, X_BL);
    const geometry::Pose X_WB{geometry::rotation_from_vector({0.0, 0.0, 0.2 * trial}), {0.1, 0.05, 0.1}};
    for (std::size_t link = 0; link <= 7; ++link) X_WL[link] = X_WB * X_BL[link];
    still.sense(X_BL, 7, world);
    moving.sense(X_WL, 7, empty, all_links(), std::vector<MovingFluid>{{&world, X_WB}});
    for (std::size_t link = 1; link <= 7; ++link) {
      const ViscousSums expected = still.sums()[link].turned(X_WB.rotation);
      // Sensors on the border of a voxel may fall on either side.
      const double tolerance = 2e-3 * expected.mu + 1e-12;
      EXPECT_NEAR(moving.sums()[link].mu, expected.mu, tolerance);
      EXPECT_LT((moving.sums()[link].mu_d - expected.mu_d).norm(), tolerance);
      EXPECT_LT((moving.sums()[link].gradient - expected.gradient).norm(),
                0.02 * expected.gradient.norm() + 1e-6);
    }
    EXPECT_EQ(moving.worst().mu, still.worst().mu);
  }
}

/// Sensors of one link at random places, with random μ, and what a flow does to them one by one.
TEST(Flow, RelievesJointsByTheSumOverAllSensors) {
  const SerialArm arm = test_arms::suspended(test_arms::at(0.0, 0.0, 1.5));
  std::mt19937 random(4);
  std::normal_distribution<double> normal;
  const auto vector = [&] { return Eigen::Vector3d(normal(random), normal(random), normal(random)); };
  for (int trial = 0; trial < 100; ++trial) {
    JointArray q{}, v{};
    for (std::size_t i = 0; i < 7; ++i) q[i] = 0.4 * normal(random), v[i] = 0.3 * normal(random);
    LinkPoses X_WL;
    arm.link_poses(q, X_WL);
    LinkSums sums{};
    MovingSums flow{&sums, vector(), 0.2 * vector(), 0.3 * vector()};
    JointArray pushed{};
    for (std::size_t link = 1; link <= 7; ++link) {
      if (random() % 3 == 0) continue;
      for (int i = 0; i < 20; ++i) {
        const double m = std::abs(normal(random));
        const Eigen::Vector3d d = 0.1 * vector(), p = X_WL[link].translation_m + d;
        sums[link].mu += m;
        sums[link].mu_d += m * d;
        sums[link].mu_dd += m * d * d.transpose();
        const Eigen::Vector3d u = flow.linear_m_s + flow.angular_rad_s.cross(p - flow.origin_m);
        arm.add_force(link, p, m * u, X_WL, pushed);
      }
    }
    DragCoefficients drag;
    drag_coefficients(arm, X_WL, sums, {}, v, drag);
    const DragCoefficients before = drag;
    constexpr double kStill = 0.005;
    relieve_by_flow(arm, X_WL, {&flow, 1}, kStill, v, drag);
    for (std::size_t j = 0; j < 7; ++j) {
      if (before.plus[j] <= 0.0) continue;
      const double w = pushed[j] / before.plus[j], at = std::max(std::abs(v[j]), kStill);
      EXPECT_NEAR(drag.plus[j], before.plus[j] * std::clamp(1.0 - w / at, 0.0, 1.0), 1e-9 * before.plus[j]);
      EXPECT_NEAR(drag.minus[j], before.minus[j] * std::clamp(1.0 + w / at, 0.0, 1.0), 1e-9 * before.plus[j]);
    }
    EXPECT_EQ(drag.coupled, before.coupled);
    flow.linear_m_s = flow.angular_rad_s = Eigen::Vector3d::Zero();
    DragCoefficients at_rest = before;
    relieve_by_flow(arm, X_WL, {&flow, 1}, kStill, v, at_rest);
    EXPECT_EQ(at_rest, before) << "fluid at rest relieves nothing";
  }
}

}  // namespace
}  // namespace phantom::robot::moving_fluid_test

#include "common/robot/sensing/viscosity_filter.hpp"

#include <gtest/gtest.h>

#include <deque>
#include <random>

#include "common/robot/sensing/skin_sensing.hpp"
#include "common/robot/tests/test_arms.hpp"
#include "common/robot/tests/test_worlds.hpp"
#include "tests/support/heap_guard.hpp"

namespace phantom::robot {
namespace {

const MemoryWeights kFading{1, 0.9, 0.75, 0.55, 0.3, 0.2, 0.1, 0.05, 0.02};  // case III of table 4.2

/// Eq. 4.10 with a history that never forgets: newest first, the first value stands for all before it.
class LiteralMemory {
 public:
  explicit LiteralMemory(const MemoryWeights& weights) : weights_(weights) {}
  double sense(std::uint32_t voxel, double mu) {
    if (history_.empty() || voxel != voxel_) history_.push_front(mu);
    history_.front() = mu;
    voxel_ = voxel;
    double sum = 0.0, total = 0.0;
    for (std::size_t i = 0; i < weights_.size(); ++i) {
      sum += weights_[i] * history_[std::min(i, history_.size() - 1)];
      total += weights_[i];
    }
    return sum / total;
  }

 private:
  MemoryWeights weights_;
  std::deque<double> history_;
  std::uint32_t voxel_ = 0;
};

TEST(ViscosityFilter, IsTheWeightedMeanOfTheVoxelsPassed) {
  std::mt19937 random(1);
  for (const MemoryWeights& weights :
       {MemoryWeights{1}, MemoryWeights{1, 1, 1}, MemoryWeights(10, 1.0), kFading}) {
    ViscosityFilter memory(3, weights);
    std::vector<LiteralMemory> literal(3, LiteralMemory(weights));
    std::array<std::uint32_t, 3> voxel{};
    std::array<float, 3> mu{};
    for (int step = 0; step < 500; ++step) {
      for (std::size_t s = 0; s < 3; ++s) {
        if (step == 0 || random() % 3 == 0) voxel[s] += 1, mu[s] = static_cast<float>(random() % 8) * 4.5F;
        EXPECT_NEAR(memory.sense(s, voxel[s], mu[s]), literal[s].sense(voxel[s], static_cast<double>(mu[s])),
                    1e-12);
      }
    }
  }
}

TEST(ViscosityFilter, OneVoxelOfMemoryIsNone) {
  ViscosityFilter memory(1, {1.0});
  for (std::uint32_t v = 0; v < 20; ++v) EXPECT_EQ(memory.sense(0, v, static_cast<float>(v)), v);
}

TEST(ViscosityFilter, StandingStillWritesNothingButFollowsAChangedField) {
  ViscosityFilter memory(1, {1, 1});
  memory.sense(0, 1, 10.0F);
  EXPECT_DOUBLE_EQ(memory.sense(0, 2, 20.0F), 15.0);
  for (int i = 0; i < 5; ++i) EXPECT_DOUBLE_EQ(memory.sense(0, 2, 20.0F), 15.0);  // time does not count
  EXPECT_DOUBLE_EQ(memory.sense(0, 2, 40.0F), 25.0);                              // an object came nearer
  memory.forget();
  EXPECT_DOUBLE_EQ(memory.sense(0, 3, 7.0F), 7.0);  // no delay after a start
}

/// Six layers of four voxels, traversed voxel by voxel: the steps shrink as table 4.2 says.
TEST(ViscosityFilter, SmoothsTheThesissLayers) {
  const std::vector<float> layers{0, 8, 9, 10, 11, 13, 20, 32};
  const auto greatest_step = [&](const MemoryWeights& weights) {
    ViscosityFilter memory(1, weights);
    double before = 0.0, step = 0.0;
    for (std::uint32_t v = 0; v < 32; ++v) {
      const double mu = memory.sense(0, v, layers[v / 4]);
      step = std::max(step, mu - before);
      EXPECT_GE(mu, before - 1e-12);
      before = mu;
    }
    return step;
  };
  EXPECT_DOUBLE_EQ(greatest_step({1}), 12.0);
  EXPECT_DOUBLE_EQ(greatest_step({1, 1, 1}), 4.0);
  EXPECT_LT(greatest_step(kFading), 4.0);
  EXPECT_LT(greatest_step(MemoryWeights(10, 1.0)), 2.5);
}

TEST(ViscosityFilter, RefusesWeightsThatCannotBe) {
  for (const MemoryWeights& bad :
       {MemoryWeights{}, MemoryWeights{0.0, 1.0}, MemoryWeights{1.0, -0.1}, MemoryWeights(17, 1.0)})
    EXPECT_THROW(ViscosityFilter(1, bad), std::invalid_argument);
}

TEST(ViscosityFilter, ASkinRemembersEachSensorsWay) {
  const SerialArm arm = test_arms::suspended();
  const SkinLayout layout = *lay_out_skin(arm, test_worlds::tubes(), {.voxel_size_m = 0.01});
  const workspace::Workspace world = test_worlds::balls();
  SkinSensing sensing(layout, {.gradient = true, .memory = kFading});
  std::vector<LiteralMemory> literal(layout.size(), LiteralMemory(kFading));
  LinkPoses X_WL;
  double felt = 0.0;
  for (int step = 0; step < 40; ++step) {
    const double t = 0.02 * step;
    arm.link_poses({0.1, 0.4 + t, 0.9 - t, -1.2 + t, 0.2, 0.3, 0.1}, X_WL);
    {
      const test::HeapGuard guard;
      sensing.sense(X_WL, 7, world);
    }
    for (std::size_t link = 1; link <= 7; ++link) {
      double sum = 0.0;
      for (std::size_t s = layout.first[link]; s < layout.first[link + 1]; ++s) {
        const workspace::Index3 v = world.grid().index_of(X_WL[link] * layout.position(s));
        const auto id = static_cast<std::uint32_t>((v.z * 10'000 + v.y) * 1'000 + v.x);
        sum += layout.weight[s] * literal[s].sense(id, static_cast<double>(world.mu(v)));
      }
      EXPECT_NEAR(sensing.sums()[link].mu, sum, 1e-9 * sum + 1e-15);
      felt += sum;
    }
  }
  EXPECT_GT(felt, 0.0);
}

}  // namespace
}  // namespace phantom::robot

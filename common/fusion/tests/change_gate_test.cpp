// What is published changes when enough frames agree, in whole components, and never for jitter.
#include "common/fusion/change_gate.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <random>
#include <set>
#include <vector>

namespace phantom::fusion {
namespace {

using workspace::Index3;
using workspace::VoxelBox;

/// A frame that sees the voxels that `seen` names and finds those that `occupied` names occupied, the others
/// in front.
ChangeGate::Settled vote_and_settle(BlockPool& pool, ChangeGate& gate,
                                    const std::function<bool(Index3)>& occupied,
                                    const std::function<bool(Index3)>& seen) {
  pool.box().for_each([&](Index3 block) {
    FusedBlock* fused = pool.find(block);
    if (fused == nullptr) fused = pool.allocate(pool.box().index(block));
    detail::BlockVotes votes{};
    voxels_of(block).for_each([&](Index3 v) {
      const auto z = static_cast<std::size_t>(v.z & 7);
      const std::uint64_t bit = bit_of(v.x & 7, v.y & 7);
      if (!seen(v)) return;
      votes.observed[z] |= bit;
      (occupied(v) ? votes.occupied : votes.in_front)[z] |= bit;
    });
    gate.vote(*fused, votes, false);
  });
  return gate.settle();
}

class Gate : public testing::Test {
 protected:
  ChangeGate::Settled frame(
      const std::function<bool(Index3)>& occupied,
      const std::function<bool(Index3)>& seen = [](Index3) { return true; }) {
    return vote_and_settle(pool, gate, occupied, seen);
  }
  std::size_t published() const { return gate.published().count(); }

  workspace::GridSpec grid{{}, 0.005, {70, 30, 20}};  // not whole blocks
  BlockPool pool{grid, 200};
  ChangeGate gate{grid, pool, 8};
};

auto in_box(const VoxelBox& box) {
  return [box](Index3 v) { return box.contains(v); };
}
const auto kNothing = [](Index3) { return false; };
const VoxelBox kCube{{60, 6, 6}, {4, 4, 4}};  // across a block's and a word's border

TEST_F(Gate, PublishesNewMatterAfterTwoFramesAndWithdrawsItAfterThree) {
  frame(in_box(kCube));
  EXPECT_EQ(published(), 0U);
  EXPECT_EQ(frame(in_box(kCube)).appeared, 64U);
  EXPECT_EQ(published(), 64U);
  EXPECT_FALSE(gate.changed_blocks().empty());
  gate.clear_changes();
  frame(kNothing);
  frame(kNothing);
  EXPECT_EQ(published(), 64U);
  EXPECT_TRUE(gate.changed_blocks().empty());
  EXPECT_EQ(frame(kNothing).vanished, 64U);
  EXPECT_EQ(published(), 0U);
}

TEST_F(Gate, NeverPublishesJitter) {
  for (int i = 0; i < 200; ++i) frame(i % 2 == 0 ? std::function<bool(Index3)>(in_box(kCube)) : kNothing);
  EXPECT_EQ(published(), 0U);
  frame(in_box(kCube));
  frame(in_box(kCube));
  gate.clear_changes();
  for (int i = 0; i < 200; ++i) frame(i % 3 == 0 ? std::function<bool(Index3)>(in_box(kCube)) : kNothing);
  EXPECT_EQ(published(), 64U);
  EXPECT_TRUE(gate.changed_blocks().empty());
}

TEST_F(Gate, FramesThatDoNotSeeAVoxelNeitherConfirmNorContradict) {
  frame(in_box(kCube));
  for (int i = 0; i < 10; ++i) frame(kNothing, kNothing);
  EXPECT_EQ(published(), 0U);
  frame(in_box(kCube));
  EXPECT_EQ(published(), 64U);
  frame(kNothing);
  frame(kNothing, kNothing);
  frame(kNothing);
  EXPECT_EQ(published(), 64U);
  frame(kNothing);
  EXPECT_EQ(published(), 0U);
}

TEST_F(Gate, HoldsBackSpeckle) {
  const VoxelBox speckle{{20, 20, 10}, {7, 1, 1}}, enough{{20, 10, 10}, {8, 1, 1}};
  for (int i = 0; i < 100; ++i) frame([&](Index3 v) { return speckle.contains(v) || enough.contains(v); });
  EXPECT_EQ(published(), 8U);
  EXPECT_FALSE(gate.published().get(speckle.min));
}

/// Literal: the voxels in components of at least 8, connected through 26 neighbours.
std::set<Index3> large_components(std::set<Index3> left) {
  std::set<Index3> large;
  while (!left.empty()) {
    std::vector<Index3> component{*left.begin()};
    left.erase(left.begin());
    for (std::size_t i = 0; i < component.size(); ++i) {
      VoxelBox{component[i] - Index3{1, 1, 1}, {3, 3, 3}}.for_each([&](Index3 n) {
        if (left.erase(n) != 0) component.push_back(n);
      });
    }
    if (component.size() >= 8) large.insert(component.begin(), component.end());
  }
  return large;
}

TEST(ScatteredMatter, IsPublishedInComponentsThatAreLargeEnoughAcrossBlocks) {
  for (const unsigned per_thousand : {20U, 40U, 60U, 80U, 110U, 150U}) {
    std::mt19937 random(per_thousand);
    std::set<Index3> there;
    const workspace::GridSpec grid{{}, 0.005, {70, 30, 20}};
    VoxelBox::of(grid).for_each([&](Index3 v) {
      if (random() % 1000 < per_thousand) there.insert(v);
    });
    BlockPool pool(grid, 200);
    ChangeGate gate(grid, pool, 8);
    for (std::uint32_t i = 0; i < 2 * kSmallChangeTurns; ++i)
      vote_and_settle(
          pool, gate, [&](Index3 v) { return there.contains(v); }, [](Index3) { return true; });
    std::set<Index3> published;
    VoxelBox::of(grid).for_each([&](Index3 v) {
      if (gate.published().get(v)) published.insert(v);
    });
    const std::set<Index3> expected = large_components(there);
    EXPECT_EQ(published, expected) << per_thousand << " voxels of 1000: " << expected.size() << " of "
                                   << there.size() << " are in large components";
  }
}

TEST_F(Gate, ClearsWhatALargerComponentLeavesBehind) {
  frame(in_box(kCube));
  frame(in_box(kCube));
  const VoxelBox rest{kCube.min, {2, 3, 1}};
  for (int i = 0; i < 3; ++i) frame(in_box(rest));
  EXPECT_EQ(published(), 0U);
}

TEST_F(Gate, SmallChangesWaitForTheTurnOfTheirBrick) {
  const VoxelBox plate{{0, 0, 4}, {60, 30, 2}};
  frame(in_box(plate));
  frame(in_box(plate));
  gate.clear_changes();
  // Every voxel of the plate that is alone in its surroundings goes; the holes are small changes.
  const auto with_holes = [&](Index3 v) {
    return plate.contains(v) && !(v.x % 4 == 1 && v.y % 4 == 1 && v.z == 4);
  };
  std::array<int, 2> frames_with_change{};  // of the plate's two bricks
  for (std::uint32_t i = 0; i < 2 * kSmallChangeTurns; ++i) {
    frame(with_holes);
    std::array<bool, 2> changed{};
    for (const Index3 block : gate.changed_blocks()) changed.at(static_cast<std::size_t>(block.x / 4)) = true;
    for (std::size_t brick = 0; brick < 2; ++brick) frames_with_change[brick] += changed[brick] ? 1 : 0;
    gate.clear_changes();
  }
  EXPECT_EQ(frames_with_change, (std::array<int, 2>{1, 1}));
  EXPECT_EQ(published(), 60U * 30U * 2U - 15U * 8U);
}

TEST_F(Gate, PublishedBitsOfBlocksAndOfTheVolumeAreTheSame) {
  std::mt19937 random(3);
  for (int i = 0; i < 60; ++i) {
    const VoxelBox a{{static_cast<int>(random() % 60), static_cast<int>(random() % 25), 3}, {9, 4, 6}};
    const int sieve = 1 + static_cast<int>(random() % 9);
    for (int k = 0; k < 3; ++k)
      frame([&](Index3 v) { return a.contains(v) && (v.x * 7 + v.y * 3 + v.z) % sieve != 1; });
    pool.box().for_each([&](Index3 block) { ASSERT_EQ(pool.find(block)->published, gate.bits_of(block)); });
  }
}

}  // namespace
}  // namespace phantom::fusion

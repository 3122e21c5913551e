#include <gtest/gtest.h>

#include <atomic>
#include <memory>
#include <thread>

#include "common/geometry/implicit/primitives.hpp"
#include "common/layers/activation.hpp"
#include "common/workspace/tests/random_workspace.hpp"
#include "common/workspace/workspace_assembler.hpp"

namespace phantom::workspace {
namespace {

/// Hands the assembler what `workspace` is, as its next version.
void take(WorkspaceAssembler& assembler, const Workspace& workspace) {
  for (const BrickKey key : workspace.bricks())
    ASSERT_TRUE(assembler.put_brick(key, workspace.version, encode_brick(workspace.brick(key))));
  ASSERT_TRUE(
      assembler.commit({workspace.version, workspace.grid(), workspace.palette(),
                        static_cast<std::uint32_t>(workspace.brick_count()), workspace.content_hash()}));
}

// A reader that holds a version until the next one stands, and lets go before the next but one is made in its
// place. Nothing but the version's own reference count orders what it read before what is then written: that
// the figures are right shows little on a machine that orders loads; it is the thread sanitizer that tells.
TEST(WorkspaceAssembler, WritesIntoAVersionOnlyAfterItsLastReaderIsDone) {
  Workspace next = random_workspace(5);
  WorkspaceAssembler assembler;
  take(assembler, next);
  const auto change = [&next](std::size_t voxel) {
    ++next.version;
    next.edit_brick(next.bricks().front()).mu_code[voxel] ^= 1;
  };
  for (std::size_t round = 0; round < 5; ++round) {
    std::atomic<bool> read{false}, let_go{false};
    std::uint64_t seen = 0;
    const std::uint64_t hash = next.content_hash();
    std::thread reader([held = assembler.current(), &read, &let_go, &seen]() mutable {
      while (!read.load(std::memory_order_relaxed)) std::this_thread::yield();
      seen = held->content_hash();
      held.reset();
      let_go.store(true, std::memory_order_relaxed);
    });
    change(2 * round);
    take(assembler, next);
    read.store(true, std::memory_order_relaxed);
    while (!let_go.load(std::memory_order_relaxed)) std::this_thread::yield();
    change(2 * round + 1);
    take(assembler, next);
    reader.join();
    EXPECT_EQ(seen, hash);
    ASSERT_NE(assembler.current(), nullptr);
    EXPECT_EQ(assembler.current()->content_hash(), next.content_hash());
  }
}

TEST(WorkspaceAssembler, AConsumersCellTakesItsCodesAndOrdersAndASecondVersionItsCodes) {
  // The boundary has the interior's μ, the guard that of the first layer.
  const LayerProfile profile{{2, 3}, {30.0F, 10.0F}, 100.0F, 1};
  const auto activated = layers::activate_alone({"sphere", 1, geometry::make_sphere(0.4, 4), profile}, 0.01);
  ASSERT_TRUE(activated) << activated.status().message();
  Workspace made = activated->first;
  made.version = 1;
  WorkspaceAssembler assembler;
  take(assembler, made);
  const auto first = assembler.current();
  EXPECT_LT(first->bytes(), made.brick_count() * kBrickVoxels * 9 / 4 + 2 * kBrickVoxels);
  EXPECT_EQ(first->content_hash(), made.content_hash());
  for (const BrickKey key : made.bricks()) {
    for (std::uint32_t i = 0; i < kBrickVoxels; ++i)
      ASSERT_EQ(first->brick(key).order[i], made.brick(key).order[i]);
  }
  assembler.prepare();  // the second buffer
  const BrickKey key = made.bricks().front();
  made.version = 2;
  const std::int8_t before = made.brick(key).order[8];
  made.edit_brick(key).order[7] = 55;
  ASSERT_TRUE(assembler.put_brick(key, 2, encode_brick(made.brick(key))));
  ASSERT_TRUE(assembler.commit(describe(made)));
  const auto second = assembler.current();
  ASSERT_NE(second, first);
  std::size_t shared = 0;
  for (const BrickKey each : made.bricks())
    shared += first->brick(each).order == second->brick(each).order ? 1 : 0;
  EXPECT_EQ(shared, made.brick_count() - 1);
  // One that is changed has orders of its own.
  EXPECT_EQ(second->brick(key).order[7], 55);
  EXPECT_EQ(second->brick(key).order[8], before);
  EXPECT_NE(first->brick(key).order[7], 55);
}

}  // namespace
}  // namespace phantom::workspace

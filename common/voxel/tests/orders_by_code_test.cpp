#include "common/voxel/orders_by_code.hpp"

#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <random>

#include "common/geometry/primitives.hpp"
#include "common/voxel/activation.hpp"
#include "common/voxel/brick_codec.hpp"
#include "common/voxel/workspace_assembler.hpp"

namespace phantom::voxel {
namespace {

/// Noise of `codes` codes; the voxels of one code have `orders` orders.
BrickData noisy_brick(unsigned seed, unsigned codes, unsigned orders) {
  std::mt19937 random(seed);
  BrickData brick{};
  for (std::size_t i = 0; i < kBrickVoxels; ++i) {
    brick.mu_code[i] = static_cast<std::uint8_t>(256 - codes + random() % codes);
    brick.order[i] = static_cast<std::int8_t>(brick.mu_code[i] * 7U + 100 * (random() % orders));
  }
  return brick;
}

void expect_told(const OrdersByCode& told, const BrickData& brick) {
  ASSERT_NE(told.tables, nullptr);
  const std::uint64_t* second = told.second.empty() ? nullptr : told.second.data();
  std::array<std::int8_t, kBrickVoxels> orders;
  orders_by_code(*told.tables, second, brick.mu_code.data(), orders.data());
  EXPECT_EQ(orders, brick.order);
  std::size_t wrong = 0;
  for (std::size_t i = 0; i < kBrickVoxels; ++i)
    wrong += order_by_code(*told.tables, second, i, brick.mu_code[i]) != brick.order[i] ? 1 : 0;
  EXPECT_EQ(wrong, 0U);
}

TEST(OrdersByCode, TellEveryVoxelsOrderWithEveryInstructionSet) {
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    hwy::SetSupportedTargetsForTest(target);
    SCOPED_TRACE(hwy::TargetName(target));
    for (const unsigned codes : {1U, 7U, 40U, 256U}) {
      for (const unsigned orders : {1U, 2U}) {
        OrderPacker packer;
        const BrickData brick = noisy_brick(codes, codes, orders);
        const OrdersByCode told = packer.pack(brick);
        expect_told(told, brick);
        EXPECT_EQ(packer.pack(brick).tables, told.tables);  // nothing new
      }
    }
  }
  hwy::SetSupportedTargetsForTest(0);
}

TEST(OrdersByCode, CodesOfOneOrderNeedNoBits) {
  OrderPacker packer;
  EXPECT_EQ(packer.pack(noisy_brick(1, 9, 1)).bytes(), 0U);
  EXPECT_EQ(packer.pack(noisy_brick(1, 9, 2)).bytes(), kBrickVoxels / 8);
}

TEST(OrdersByCode, MoreThanTwoOrdersOfACodeAreNotTold) {
  OrderPacker packer;
  const BrickData two = noisy_brick(1, 5, 2);
  EXPECT_EQ(packer.pack(noisy_brick(2, 5, 3)).tables, nullptr);
  expect_told(packer.pack(two), two);
  BrickData one_more = two;
  one_more.order[kBrickVoxels - 1] = 1;
  EXPECT_EQ(packer.pack(one_more).tables, nullptr);
  expect_told(packer.pack(two), two);
}

TEST(OrdersByCode, BricksThatContradictEachOtherHaveTablesOfTheirOwn) {
  OrderPacker packer;
  const BrickData one = noisy_brick(1, 5, 2);
  BrickData other = one;
  for (std::int8_t& order : other.order) order = static_cast<std::int8_t>(order + 1);
  const OrdersByCode of_one = packer.pack(one), of_other = packer.pack(other);
  expect_told(of_one, one);
  expect_told(of_other, other);
}

TEST(OrdersByCode, AConsumersCellTakesLittleMoreThanItsCodes) {
  // The boundary has the interior's μ, the guard that of the first layer.
  const LayerProfile profile{{2, 3}, {30.0F, 10.0F}, 100.0F, 1};
  const auto activated = activate_alone({"sphere", 1, geometry::make_sphere(0.4, 4), profile}, 0.01);
  ASSERT_TRUE(activated) << activated.status().message();
  const Workspace& made = activated->first;
  WorkspaceAssembler assembler;
  for (const BrickKey key : made.bricks())
    ASSERT_TRUE(assembler.put_brick(key, 1, encode_brick(made.brick(key))));
  ASSERT_TRUE(assembler.commit(
      {1, made.grid(), made.palette(), static_cast<std::uint32_t>(made.brick_count()), made.content_hash()}));
  Workspace taken = *assembler.current();
  EXPECT_LT(taken.bytes(), made.brick_count() * kBrickVoxels * 5 / 4 + 2 * kBrickVoxels);
  EXPECT_EQ(taken.content_hash(), made.content_hash());
  for (const BrickKey key : made.bricks()) {
    for (std::uint32_t i = 0; i < kBrickVoxels; ++i)
      ASSERT_EQ(taken.brick(key).order_of(i), made.brick(key).order_of(i));
  }
  // One that is changed has orders of its own.
  const BrickKey key = made.bricks().front();
  const std::int8_t before = taken.brick(key).order_of(8);
  taken.make_brick(key).order[7] = 55;
  EXPECT_EQ(taken.brick(key).order_of(7), 55);
  EXPECT_EQ(taken.brick(key).order_of(8), before);
}

}  // namespace
}  // namespace phantom::voxel

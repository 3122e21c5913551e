#include "common/workspace/brick_codec.hpp"

#include <gtest/gtest.h>
#include <hwy/targets.h>
#include <zstd.h>

#include <algorithm>
#include <cstring>
#include <functional>
#include <memory>
#include <random>
#include <tuple>

#include "common/geometry/implicit/primitives.hpp"
#include "common/layers/activation.hpp"
#include "common/workspace/brick_tiles.hpp"
#include "common/workspace/tests/random_workspace.hpp"

namespace phantom::workspace::brick_codec_test {
namespace {

using Bytes = std::vector<std::uint8_t>;
using Kind = std::tuple<std::uint8_t, std::int8_t, std::uint16_t>;  // μ code, order, object

Kind kind_of(const BrickData& brick, std::size_t i) {
  return {brick.mu_code[i], brick.order[i], brick.object[i]};
}
template <class T>
std::size_t place_in(std::vector<T>& list, const T& value) {  // which it gets if need be
  const auto found = std::find(list.begin(), list.end(), value);
  if (found != list.end()) return static_cast<std::size_t>(found - list.begin());
  list.push_back(value);
  return list.size() - 1;
}

/// The tiled form, voxel by voxel, as brick_tiles.hpp tells it.
Bytes tiled_literally(const BrickData& brick) {
  std::vector<Kind> kinds;
  Bytes counts, named;
  std::vector<std::uint64_t> masks;
  for (std::size_t tile = 0; tile < 512; ++tile) {
    std::vector<std::size_t> here;
    std::vector<std::uint64_t> voxels(64, 0);
    for (std::size_t i = 0; i < 64; ++i)
      voxels[place_in(here, place_in(kinds, kind_of(brick, 64 * tile + i)))] |= std::uint64_t{1} << i;
    counts.push_back(static_cast<std::uint8_t>(here.size()));
    for (const std::size_t kind : here) named.push_back(static_cast<std::uint8_t>(kind));
    masks.insert(masks.end(), voxels.begin() + 1, voxels.begin() + static_cast<std::ptrdiff_t>(here.size()));
  }
  Bytes bytes{1, static_cast<std::uint8_t>(kinds.size() - 1)};
  for (const auto& [code, order, object] : kinds) bytes.push_back(code);
  for (const auto& [code, order, object] : kinds) bytes.push_back(static_cast<std::uint8_t>(order));
  for (const auto& [code, order, object] : kinds) {
    bytes.push_back(static_cast<std::uint8_t>(object % 256));
    bytes.push_back(static_cast<std::uint8_t>(object / 256));
  }
  bytes.insert(bytes.end(), counts.begin(), counts.end());
  bytes.insert(bytes.end(), named.begin(), named.end());
  for (const std::uint64_t mask : masks) {
    for (unsigned byte = 0; byte < 8; ++byte) bytes.push_back(static_cast<std::uint8_t>(mask >> 8 * byte));
  }
  return bytes;
}

Bytes tiled(const Workspace::BrickView& brick) {
  Bytes bytes(kMaxTiledBytes);
  bytes.resize(tile_brick(brick, std::span<std::uint8_t, kMaxTiledBytes>(bytes)));
  return bytes;
}

Bytes compressed(const void* content, std::size_t size) {
  Bytes bytes(ZSTD_compressBound(size));
  bytes.resize(ZSTD_compress(bytes.data(), bytes.size(), content, size, 1));
  return bytes;
}

void expect_same(const BrickContent& got, const BrickData& want) {
  EXPECT_EQ(std::memcmp(&got.voxels, &want, sizeof want), 0);
  const BrickFacts facts = facts_of(want);
  EXPECT_EQ(got.facts.object, facts.object);
  EXPECT_EQ(got.facts.uniform, facts.uniform);
  EXPECT_EQ(got.facts.greatest_code, facts.greatest_code);
  EXPECT_EQ(got.facts.greatest_fluid_code, facts.greatest_fluid_code);
}

/// `kinds` kinds at random, at most `in_a_tile` of them in each tile; a share of the tiles has one.
std::unique_ptr<BrickData> patchy_brick(unsigned seed, std::size_t kinds, std::size_t in_a_tile) {
  std::mt19937 random(seed);
  std::vector<Kind> all(kinds);
  for (std::size_t i = 0; i < kinds; ++i) {
    const auto code = static_cast<std::uint8_t>(random() % 256);
    const auto order = static_cast<std::int8_t>(random() % 2 == 0 ? code : i);
    all[i] = {code, order, static_cast<std::uint16_t>(random() % 4 == 0 ? random() : i % 3)};
  }
  auto brick = std::make_unique<BrickData>();
  for (std::size_t tile = 0; tile < 512; ++tile) {
    const std::size_t first = random() % kinds, here = random() % 2 == 0 ? 1 : in_a_tile;
    for (std::size_t i = 64 * tile; i < 64 * (tile + 1); ++i) {
      std::tie(brick->mu_code[i], brick->order[i], brick->object[i]) = all[(first + random() % here) % kinds];
    }
  }
  return brick;
}

void for_each_instruction_set(const std::function<void()>& test) {
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    hwy::SetSupportedTargetsForTest(target);
    SCOPED_TRACE(hwy::TargetName(target));
    test();
  }
  hwy::SetSupportedTargetsForTest(0);
}

TEST(BrickTiles, AreWhatTheLiteralTwinWritesWithEveryInstructionSet) {
  for_each_instruction_set([] {
    auto content = std::make_unique<BrickContent>();
    for (const std::size_t kinds : {1U, 2U, 3U, 9U, 100U, 256U}) {
      for (const std::size_t in_a_tile : {1U, 2U, 3U, 10U}) {
        const auto brick = patchy_brick(static_cast<unsigned>(kinds + in_a_tile), kinds, in_a_tile);
        const Bytes bytes = tiled(brick->view());
        ASSERT_EQ(bytes, tiled_literally(*brick));
        ASSERT_TRUE(untile_brick(bytes, *content));
        expect_same(*content, *brick);
      }
    }
  });
}

TEST(BrickTiles, TileMayHave64Kinds) {
  auto brick = patchy_brick(1, 64, 1);
  for (std::size_t i = 0; i < 64; ++i) brick->mu_code[640 + i] = static_cast<std::uint8_t>(i);
  brick->order.fill(0);
  brick->object.fill(0);
  const Bytes bytes = tiled(brick->view());
  ASSERT_EQ(bytes, tiled_literally(*brick));
  auto content = std::make_unique<BrickContent>();
  ASSERT_TRUE(untile_brick(bytes, *content));
  expect_same(*content, *brick);
}

TEST(BrickTiles, SayWhatDoesNotFit) {
  auto brick = std::make_unique<BrickData>();
  for (std::size_t i = 0; i < 256; ++i) brick->mu_code[64 * i] = static_cast<std::uint8_t>(i);
  EXPECT_FALSE(tiled(brick->view()).empty());
  brick->order[64 * 257] = 1;
  EXPECT_TRUE(tiled(brick->view()).empty());  // 257 kinds
  EXPECT_FALSE(tiled(patchy_brick(1, 60, 10)->view()).empty());
  EXPECT_TRUE(tiled(patchy_brick(1, 60, 60)->view()).empty());  // too many bytes
}

TEST(BrickTiles, RefuseWhatIsNotAsTold) {
  const auto brick = patchy_brick(4, 3, 3);
  const Bytes good = tiled(brick->view());
  auto content = std::make_unique<BrickContent>();
  ASSERT_TRUE(untile_brick(good, *content));
  const std::size_t counts = 2 + 4 * 3, named = counts + 512;
  const std::size_t masks =
      named + std::accumulate(good.begin() + counts, good.begin() + named, std::size_t{0});
  const auto mixed = static_cast<std::size_t>(
      std::find_if(good.begin() + counts, good.begin() + named, [](auto n) { return n > 2; }) - good.begin());
  std::size_t mask = masks;
  for (std::size_t at = counts; at < mixed; ++at) mask += 8 * (good[at] - 1U);
  const auto expect_refused = [&](const std::function<void(Bytes&)>& damage, const std::string& why) {
    Bytes bytes = good;
    damage(bytes);
    const core::Status status = untile_brick(bytes, *content);
    EXPECT_FALSE(status) << why;
    EXPECT_NE(status.message().find(why), std::string::npos) << status.message();
  };
  expect_refused([](Bytes& b) { b.clear(); }, "unknown form");
  expect_refused([](Bytes& b) { b[0] = 2; }, "unknown form");
  for (const std::size_t size : {std::size_t{2}, counts - 1, named - 1, masks - 1, good.size() - 1})
    expect_refused([&](Bytes& b) { b.resize(size); }, "cut short");
  expect_refused([](Bytes& b) { b.push_back(0); }, "too many");
  expect_refused([&](Bytes& b) { b[counts] = 0; }, "no kind");
  expect_refused([&](Bytes& b) { b[counts] = 65; }, "more than 64");
  expect_refused([&](Bytes& b) { std::fill_n(b.begin() + counts, 512, std::uint8_t{64}); }, "more kinds");
  expect_refused([&](Bytes& b) { b[named] = 3; }, "do not occur");
  expect_refused(
      [&](Bytes& b) { std::replace(b.begin() + named, b.begin() + masks, std::uint8_t{2}, std::uint8_t{1}); },
      "do not occur");
  expect_refused([&](Bytes& b) { std::fill_n(&b[mask], 8, std::uint8_t{0}); }, "do not occur");
  expect_refused([&](Bytes& b) { std::copy_n(&b[mask], 8, &b[mask + 8]); }, "voxels twice");
  expect_refused(
      [&](Bytes& b) {
        for (int i = 0; i < 8; ++i) b[mask + i] = static_cast<std::uint8_t>(~b[mask + 8 + i]);
      },
      "do not occur");  // none is left for the first kind
}

TEST(BrickCodec, RoundTripOfNoise) {
  const Workspace workspace = random_workspace(3);
  auto back = std::make_unique<BrickContent>();
  for (const BrickKey key : workspace.bricks()) {
    const auto brick = workspace.brick(key);
    const Bytes bytes = encode_brick(brick);
    ASSERT_EQ(ZSTD_getFrameContentSize(bytes.data(), bytes.size()), sizeof(BrickData));  // too many kinds
    ASSERT_TRUE(decode_brick(bytes, *back));
    EXPECT_EQ(std::memcmp(back->voxels.mu_code.data(), brick.mu_code, kBrickVoxels), 0);
    EXPECT_EQ(std::memcmp(back->voxels.order.data(), brick.order, kBrickVoxels), 0);
    EXPECT_EQ(std::memcmp(back->voxels.object.data(), brick.object, 2 * kBrickVoxels), 0);
    expect_same(*back, back->voxels);
  }
}

TEST(BrickCodec, RoundTripOfAnyNumberOfKinds) {
  auto back = std::make_unique<BrickContent>();
  std::mt19937 random(7);
  for (unsigned round = 0; round < 60; ++round) {
    const auto brick = patchy_brick(round, 1 + random() % (round % 2 == 0 ? 12 : 300), 1 + random() % 70);
    ASSERT_TRUE(decode_brick(encode_brick(brick->view()), *back));
    expect_same(*back, *brick);
  }
}

TEST(BrickCodec, BytesDoNotDependOnHowAWorkspaceKeepsTheBrick) {
  // Of one object; the same with all arrays.
  const LayerProfile profile{{2, 3}, {30.0F, 10.0F}, 100.0F, 1};
  const auto made = layers::activate_alone({"sphere", 1, geometry::make_sphere(0.4, 4), profile}, 0.01);
  ASSERT_TRUE(made) << made.status().message();
  Workspace kept(made->first.grid(), made->first.palette());
  auto back = std::make_unique<BrickContent>();
  for (const BrickKey key : made->first.bricks()) {
    const Bytes bytes = encode_brick(made->first.brick(key));
    EXPECT_LT(bytes.size(), 8000U);
    ASSERT_TRUE(decode_brick(bytes, *back));
    EXPECT_EQ(encode_brick(back->voxels.view()), bytes);
    const auto to = kept.edit_brick(key);
    std::copy_n(back->voxels.mu_code.data(), kBrickVoxels, to.mu_code);
    std::copy_n(back->voxels.order.data(), kBrickVoxels, to.order);
    std::copy_n(back->voxels.object.data(), kBrickVoxels, to.object);
    ASSERT_EQ(made->first.brick(key).object, nullptr);
    EXPECT_EQ(encode_brick(kept.brick(key)), bytes);
  }
}

TEST(BrickCodec, ReadsThePlainFormOfOlderRecordings) {
  auto back = std::make_unique<BrickContent>();
  for (const std::size_t kinds : {1U, 5U, 200U}) {
    const auto brick = patchy_brick(8, kinds, 3);
    ASSERT_TRUE(decode_brick(compressed(brick.get(), sizeof *brick), *back));
    expect_same(*back, *brick);
  }
}

TEST(BrickCodec, RefusesWhatIsNoBrick) {
  auto content = std::make_unique<BrickContent>();
  const Workspace noise = random_workspace(3);
  const auto patchy = patchy_brick(2, 7, 3);
  for (const Bytes& bytes :
       {encode_brick(noise.brick(noise.bricks().front())), encode_brick(patchy->view())}) {
    EXPECT_FALSE(decode_brick({}, *content));
    EXPECT_FALSE(decode_brick(Bytes(100, 0x42), *content));
    EXPECT_FALSE(decode_brick(std::span(bytes).first(bytes.size() / 2), *content));
    EXPECT_FALSE(decode_brick(std::span(bytes).first(bytes.size() - 1), *content));
    std::mt19937 random(5);
    for (int round = 0; round < 200; ++round) {  // the checksum finds what decompression lets pass
      auto damaged = bytes;
      damaged[random() % damaged.size()] ^= static_cast<std::uint8_t>(1 + random() % 255);
      if (!decode_brick(damaged, *content)) continue;
      EXPECT_EQ(encode_brick(content->voxels.view()), bytes);
    }
  }
  const Bytes nothing(kMaxTiledBytes + 1);
  for (const std::size_t size :
       {std::size_t{0}, std::size_t{1}, std::size_t{600}, kMaxTiledBytes, nothing.size()}) {
    const core::Status status = decode_brick(compressed(nothing.data(), size), *content);
    EXPECT_FALSE(status) << size;
    EXPECT_NE(status.message().find("brick: "), std::string::npos);
  }
}

}  // namespace
}  // namespace phantom::workspace::brick_codec_test

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <numeric>
#include <random>

#include "common/workspace/tests/random_workspace.hpp"
#include "common/workspace/workspace_assembler.hpp"

namespace phantom::workspace {
namespace {

void put(WorkspaceAssembler& assembler, const Workspace& workspace, BrickKey key) {
  ASSERT_TRUE(assembler.put_brick(key, workspace.version, encode_brick(workspace.brick(key))));
}

void expect_same(const Workspace* got, const Workspace& want) {
  ASSERT_NE(got, nullptr);
  EXPECT_EQ(got->version, want.version);
  EXPECT_EQ(got->bricks(), want.bricks());
  EXPECT_EQ(got->content_hash(), want.content_hash());
  for (const BrickKey key : want.bricks()) {
    std::vector<std::uint16_t> has(kBrickVoxels), should_have(kBrickVoxels);
    got->brick(key).copy_objects(has.data());
    want.brick(key).copy_objects(should_have.data());
    EXPECT_EQ(has, should_have);
  }
}

TEST(WorkspaceAssembler, TakesBricksBeforeAndAfterTheVersion) {
  const Workspace workspace = random_workspace(4);
  const auto keys = workspace.bricks();
  WorkspaceAssembler assembler;
  for (std::size_t i = keys.size() / 2; i < keys.size(); ++i) put(assembler, workspace, keys[i]);
  ASSERT_TRUE(assembler.commit(describe(workspace)));
  EXPECT_TRUE(assembler.pending());
  for (std::size_t i = 0; i < keys.size() / 2; ++i) {
    EXPECT_EQ(assembler.current(), nullptr);  // never half a volume
    EXPECT_EQ(assembler.bricks_expected(), keys.size());
    put(assembler, workspace, keys[i]);
  }
  EXPECT_FALSE(assembler.pending());
  expect_same(assembler.current().get(), workspace);
}

TEST(WorkspaceAssembler, TakesDuplicates) {
  const Workspace workspace = random_workspace(4);
  WorkspaceAssembler assembler;
  for (int twice = 0; twice < 2; ++twice) {
    for (const BrickKey key : workspace.bricks()) put(assembler, workspace, key);
  }
  ASSERT_TRUE(assembler.commit(describe(workspace)));
  expect_same(assembler.current().get(), workspace);
}

// Tries phantom_sensing: a version whose count does not fit
TEST(WorkspaceAssembler, KeepsTheLastWholeVersionWhileTheNextIsIncomplete) {
  const Workspace first = random_workspace(5);
  Workspace second = first;
  second.version = 6;
  const auto keys = second.bricks();
  second.edit_brick(keys[0]).mu_code[9] ^= 1;
  second.edit_brick(keys[1]).order[9] ^= 1;
  second.remove_brick(keys[2]);

  WorkspaceAssembler assembler;
  ASSERT_TRUE(assembler.commit(describe(first)));
  for (const BrickKey key : keys) put(assembler, first, key);
  const auto whole = assembler.current();
  ASSERT_TRUE(assembler.commit(describe(second)));
  put(assembler, second, keys[0]);
  assembler.remove_brick(keys[2]);
  EXPECT_EQ(assembler.current(), whole);
  EXPECT_TRUE(assembler.pending());
  put(assembler, second, keys[1]);
  expect_same(assembler.current().get(), second);
  expect_same(whole.get(), first);  // shared versions never change
}

// Tries phantom_sensing: whose hash does not
TEST(WorkspaceAssembler, DoesNotAcceptAWrongHash) {
  const Workspace workspace = random_workspace(5);
  WorkspaceAssembler assembler;
  for (const BrickKey key : workspace.bricks()) put(assembler, workspace, key);
  VersionDescription wrong = describe(workspace);
  wrong.content_hash ^= 1;
  ASSERT_TRUE(assembler.commit(wrong));
  EXPECT_EQ(assembler.current(), nullptr);
  EXPECT_TRUE(assembler.pending());
}

TEST(WorkspaceAssembler, DropsWhatADeadServerLeftBehind) {
  const Workspace old_cell = random_workspace(7);
  Workspace new_cell = random_workspace(8);
  ASSERT_NE(old_cell.bricks(), new_cell.bricks());
  new_cell.version = 1000;
  WorkspaceAssembler assembler;
  for (const BrickKey key : old_cell.bricks()) put(assembler, old_cell, key);
  ASSERT_TRUE(assembler.commit(describe(old_cell)));
  for (const BrickKey key : new_cell.bricks()) put(assembler, new_cell, key);
  ASSERT_TRUE(assembler.commit(describe(new_cell)));
  expect_same(assembler.current().get(), new_cell);
}

/// What a server does to a workspace from one version to the next: some bricks changed, made and removed.
struct Change {
  std::vector<BrickKey> put, removed;
};
Change change_some(Workspace& workspace, std::mt19937& random) {
  Change change;
  BrickKey key;
  for (key.z = 0; key.z < 2; ++key.z) {
    for (key.y = 0; key.y < 3; ++key.y) {
      for (key.x = 0; key.x < 4; ++key.x) {
        const auto choice = random() % 8;
        if (choice == 0 && workspace.has_brick(key)) {
          workspace.remove_brick(key);
          change.removed.push_back(key);
        } else if (choice == 1) {
          const auto brick = workspace.edit_brick(key);
          for (int i = 0; i < 50; ++i) {
            const std::size_t at = random() % kBrickVoxels;
            brick.mu_code[at] = static_cast<std::uint8_t>(random() % 4);
            brick.order[at] = static_cast<std::int8_t>(random() % 102);
            brick.object[at] = static_cast<std::uint16_t>(random());
          }
          change.put.push_back(key);
        }
      }
    }
  }
  return change;
}

double greatest_neighbour_mu(const Workspace& workspace) {
  float greatest = 0.0F;
  for (const BrickKey key : workspace.bricks()) {
    const auto brick = workspace.brick(key);
    for (std::size_t i = 0; i < kBrickVoxels; ++i) {
      if (brick.order[i] > 0 && brick.order[i] < kOrderBoundary)
        greatest = std::max(greatest, workspace.palette()[brick.mu_code[i]]);
    }
  }
  return static_cast<double>(greatest);
}

TEST(WorkspaceAssembler, FollowsAnySequenceOfChangesInAnyOrderOfArrival) {
  for (unsigned seed = 0; seed < 8; ++seed) {
    std::mt19937 random(seed);
    Workspace server = random_workspace(seed + 1);
    WorkspaceAssembler assembler;
    for (const BrickKey key : server.bricks()) put(assembler, server, key);
    ASSERT_TRUE(assembler.commit(describe(server)));
    std::vector<std::pair<std::shared_ptr<const Workspace>, std::uint64_t>> readers;
    for (int round = 0; round < 12; ++round) {
      if (random() % 2 == 0) assembler.prepare();
      if (random() % 2 == 0) readers.emplace_back(assembler.current(), assembler.current()->content_hash());
      if (random() % 3 == 0) readers.clear();
      const auto before = assembler.current();
      const Change change = change_some(server, random);
      ++server.version;
      std::vector<int> arrivals(change.put.size() + change.removed.size() + 1);  // the last: the version
      std::iota(arrivals.begin(), arrivals.end(), 0);
      std::shuffle(arrivals.begin(), arrivals.end(), random);
      for (const int arrival : arrivals) {
        const auto i = static_cast<std::size_t>(arrival);
        if (i < change.put.size()) {
          put(assembler, server, change.put[i]);
        } else if (i < change.put.size() + change.removed.size()) {
          ASSERT_TRUE(assembler.put_brick(change.removed[i - change.put.size()], server.version, {}));
        } else {
          ASSERT_TRUE(assembler.commit(describe(server)));
        }
        if (arrival != arrivals.back() && assembler.current() != before) {
          // Nothing that is left to come makes a difference: it has the version already.
          EXPECT_EQ(assembler.current()->content_hash(), server.content_hash());
        }
      }
      expect_same(assembler.current().get(), server);
      EXPECT_EQ(assembler.greatest_neighbour_mu(), greatest_neighbour_mu(server));
      for (const auto& [held, hash] : readers) EXPECT_EQ(held->content_hash(), hash);
    }
  }
}

TEST(WorkspaceAssembler, AChangeCostsItsBricksOnly) {
  Workspace server = random_workspace(6);
  const auto keys = server.bricks();
  ASSERT_GT(keys.size(), 6U);
  WorkspaceAssembler assembler;
  for (const BrickKey key : keys) put(assembler, server, key);
  ASSERT_TRUE(assembler.commit(describe(server)));
  EXPECT_EQ(assembler.bricks_written(), keys.size());
  assembler.prepare();
  const auto change = [&](std::size_t i) {
    server.edit_brick(keys[i]).mu_code[9] ^= 1;
    ++server.version;
    put(assembler, server, keys[i]);
    ASSERT_TRUE(assembler.commit(describe(server)));
    expect_same(assembler.current().get(), server);
  };
  change(0);
  EXPECT_EQ(assembler.bricks_written(), 1U);
  change(1);
  EXPECT_EQ(assembler.bricks_written(), 2U);  // not prepared: the buffer lacks the change before, too
  assembler.prepare();
  change(2);
  EXPECT_EQ(assembler.bricks_written(), 1U);
  const auto reader = assembler.current();
  change(3);
  const auto another = assembler.current();
  change(4);  // both buffers are held by readers
  EXPECT_EQ(assembler.bricks_written(), keys.size());
}

/// A palette in which the codes stay costs what its bricks cost.
TEST(WorkspaceAssembler, TakesAnotherPaletteForTheBricksThatChangeWithIt) {
  Workspace server = random_workspace(5);
  WorkspaceAssembler assembler;
  for (const BrickKey key : server.bricks()) put(assembler, server, key);
  ASSERT_TRUE(assembler.commit(describe(server)));
  for (int round = 0; round < 3; ++round) {
    assembler.prepare();
    std::vector<float> palette = server.palette();
    for (float& mu : palette) mu *= 1.5F;
    palette.push_back(2 * palette.back());
    server.set_palette(palette);
    const BrickKey key = server.bricks()[static_cast<std::size_t>(round)];
    server.edit_brick(key).mu_code[7] = static_cast<std::uint8_t>(palette.size() - 1);
    ++server.version;
    put(assembler, server, key);
    ASSERT_TRUE(assembler.commit(describe(server)));
    expect_same(assembler.current().get(), server);
    EXPECT_EQ(assembler.current()->palette(), palette);
    EXPECT_LE(assembler.bricks_written(), 2U);
  }
}

TEST(WorkspaceAssembler, TakesAnotherPaletteAndGrid) {
  const Workspace first = random_workspace(5);
  Workspace second({{0, 0, 0}, 0.01, {64, 32, 32}}, {0.0F, 1.0F, 2.0F});
  second.version = 6;
  second.edit_brick({1, 0, 0}).mu_code[7] = 2;
  WorkspaceAssembler assembler;
  for (const BrickKey key : first.bricks()) put(assembler, first, key);
  ASSERT_TRUE(assembler.commit(describe(first)));
  assembler.prepare();
  for (const BrickKey key : first.bricks()) assembler.remove_brick(key);
  put(assembler, second, {1, 0, 0});
  ASSERT_TRUE(assembler.commit(describe(second)));
  expect_same(assembler.current().get(), second);
  assembler.prepare();
  second.edit_brick({0, 0, 0}).mu_code[7] = 1;
  ++second.version;
  put(assembler, second, {0, 0, 0});
  ASSERT_TRUE(assembler.commit(describe(second)));
  expect_same(assembler.current().get(), second);
}

TEST(WorkspaceAssembler, WhatIsFormedWhileItComesMayChangeBeforeItIsWhole) {
  for (unsigned seed = 0; seed < 8; ++seed) {
    std::mt19937 random(seed);
    Workspace server = random_workspace(seed + 1);
    WorkspaceAssembler assembler;
    const auto keys = server.bricks();
    ASSERT_TRUE(assembler.commit(describe(server)));
    for (std::size_t i = 0; i < keys.size() - 2; ++i) put(assembler, server, keys[i]);
    // Some of what came is replaced or goes, and the rest of the first version never comes.
    const Change change = change_some(server, random);
    ++server.version;
    for (const BrickKey key : change.put) put(assembler, server, key);
    for (const BrickKey key : change.removed) ASSERT_TRUE(assembler.put_brick(key, server.version, {}));
    for (std::size_t i = keys.size() - 2; i < keys.size(); ++i) {
      if (server.has_brick(keys[i])) put(assembler, server, keys[i]);
    }
    EXPECT_EQ(assembler.current(), nullptr);
    ASSERT_TRUE(assembler.commit(describe(server)));
    expect_same(assembler.current().get(), server);
  }
}

TEST(WorkspaceAssembler, TheGridMayChangeBeforeTheFirstVolumeIsWhole) {
  const Workspace small = random_workspace(5);
  const auto keys = small.bricks();
  GridSpec grid = small.grid();
  for (auto& size : grid.size_vox) size += kBrickEdge;
  std::vector<float> palette = small.palette();
  palette.push_back(2 * palette.back());
  Workspace large(grid, palette);
  large.version = small.version + 1;
  WorkspaceAssembler assembler;
  ASSERT_TRUE(assembler.commit(describe(small)));
  for (std::size_t i = 1; i < keys.size(); ++i) {
    put(assembler, small, keys[i]);
    const auto made = large.edit_brick(keys[i]);
    const auto from = small.brick(keys[i]);
    std::copy_n(from.mu_code, kBrickVoxels, made.mu_code);
    std::copy_n(from.order, kBrickVoxels, made.order);
    from.copy_objects(made.object);
  }
  const BrickKey beyond{grid.size_vox[0] / kBrickEdge - 1, 0, 0};
  large.edit_brick(beyond).mu_code[0] = static_cast<std::uint8_t>(palette.size() - 1);
  put(assembler, large, beyond);
  EXPECT_EQ(assembler.current(), nullptr);
  ASSERT_TRUE(assembler.commit(describe(large)));
  expect_same(assembler.current().get(), large);
  // And back: what was formed of another grid while the first one is still shown.
  WorkspaceAssembler other;
  for (const BrickKey key : keys) put(other, small, key);
  ASSERT_TRUE(other.commit(describe(small)));
  ASSERT_TRUE(other.commit(describe(large)));
  Workspace next = small;
  next.edit_brick(keys[0]).mu_code[5] ^= 1;
  next.version = large.version + 1;
  put(other, next, keys[0]);
  expect_same(other.current().get(), small);
  ASSERT_TRUE(other.commit(describe(next)));
  expect_same(other.current().get(), next);
}

TEST(WorkspaceAssembler, DropsLeftOversOfChangedVersionsToo) {
  // The dead server had changed some bricks since its start; so has its successor when we hear of it.
  Workspace dead = random_workspace(7), heir = random_workspace(8);
  WorkspaceAssembler assembler;
  for (const BrickKey key : dead.bricks()) put(assembler, dead, key);
  ASSERT_TRUE(assembler.commit(describe(dead)));
  std::mt19937 random(3);
  for (const BrickKey key : change_some(dead, random).put) {
    dead.version = 9;
    put(assembler, dead, key);  // and no version any more
  }
  heir.version = 1000;
  const std::vector<BrickKey> first = heir.bricks();
  const Change change = change_some(heir, random);
  for (const BrickKey key : first) {
    if (heir.has_brick(key)) put(assembler, heir, key);
  }
  heir.version = 1001;
  for (const BrickKey key : change.put) put(assembler, heir, key);
  ASSERT_TRUE(assembler.commit(describe(heir)));
  expect_same(assembler.current().get(), heir);
}

TEST(WorkspaceAssembler, AcceptsAnEmptyWorkspace) {
  const Workspace empty({Eigen::Vector3d::Zero(), 0.01, {64, 64, 64}}, {0.0F, 3.0F});
  WorkspaceAssembler assembler;
  ASSERT_TRUE(assembler.commit(describe(empty)));
  ASSERT_NE(assembler.current(), nullptr);
  EXPECT_EQ(assembler.current()->brick_count(), 0U);
}

TEST(WorkspaceAssembler, DoesNotMixBricksOfVoxelsOfAnotherShape) {
  const Workspace cubes = random_workspace(5);
  GridSpec grid = cubes.grid();
  grid.voxel_size_m = VoxelSize(Eigen::Vector3d(0.005, 0.005, 0.01));
  Workspace flat(grid, cubes.palette());
  flat.version = 6;
  const BrickKey key = cubes.bricks().front();
  flat.edit_brick(key).mu_code[7] = 2;
  WorkspaceAssembler assembler;
  for (const BrickKey one : cubes.bricks()) put(assembler, cubes, one);
  ASSERT_TRUE(assembler.commit(describe(cubes)));
  const auto whole = assembler.current();
  // The content of the cubes is whole under its own description alone.
  VersionDescription posing = describe(cubes);
  posing.version = 6;
  posing.grid = grid;
  ASSERT_TRUE(assembler.commit(posing));
  EXPECT_TRUE(assembler.pending());
  EXPECT_EQ(assembler.current(), whole);
  for (const BrickKey one : cubes.bricks()) assembler.remove_brick(one);
  put(assembler, flat, key);
  ASSERT_TRUE(assembler.commit(describe(flat)));
  expect_same(assembler.current().get(), flat);
  EXPECT_EQ(assembler.current()->grid().voxel_size_m, grid.voxel_size_m);
}

}  // namespace
}  // namespace phantom::workspace

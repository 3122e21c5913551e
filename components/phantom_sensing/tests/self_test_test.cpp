// The self-test passes on what is right, and fails on each thing that is wrong.
#include "components/phantom_sensing/tools/self_test.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/core/errors.hpp"
#include "common/runtime/cell/cell.hpp"
#include "components/phantom_sensing/model.hpp"
#include "components/phantom_sensing/service.hpp"
#include "components/phantom_sensing/tests/rig.hpp"

namespace phantom::phantom_sensing::self_test_test {
namespace {

using testing::HasSubstr;

const runtime::CellConfig& bench() {
  static const runtime::CellConfig cell =
      runtime::load_cell(PHANTOM_SOURCE_DIR "/deploy/cells/arm_bench/cell.yaml");
  return cell;
}

const workspace::Workspace& bench_workspace() {
  static const workspace::Workspace workspace = build_workspace(bench());
  return workspace;
}

TEST(SelfTest, PassesWithEverySettingThatTheConfigurationAllows) {
  for (const bool directional : {false, true}) {
    for (const robot::DragMode mode : {robot::DragMode::kSeparable, robot::DragMode::kCoupled}) {
      for (const int reach : {1, 3, 7}) {
        PerceptSettings settings;
        settings.directional.enabled = directional;
        settings.mode = mode;
        settings.cluster_reach_vox = reach;
        if (reach == 7) settings.memory = {1.0, 1.0, 1.0};
        if (reach == 1) settings.cluster_shape = percept::ZoneShape::kCube;
        const SelfTestResult result = test_step(settings);
        EXPECT_TRUE(result.passed) << result.message;
      }
    }
  }
  PerceptSettings stricter;
  stricter.motion.dangerous_below_rad = 0.0;
  stricter.motion.safe_above_rad = 3.2;
  stricter.hit.mu_unsafe = 11.0;
  stricter.hit.mu_moderate = 10.5;
  EXPECT_TRUE(test_step(stricter).passed) << test_step(stricter).message;
}

// Tries phantom_sensing: a self-test fails at start
TEST(SelfTest, ThatFailsAtTheStartEndsTheServiceBeforeItJoins) {
  Config broken;
  broken.percept.directional = {.enabled = true, .leaving_share = 2.0};  // as if the step were broken
  ASSERT_FALSE(test_step(broken.percept).passed);
  try {
    run_service({}, {}, bench(), broken, rig::suspended_model(), {});
    FAIL() << "it ran";
  } catch (const std::runtime_error& problem) {  // exit code 1
    EXPECT_EQ(dynamic_cast<const core::ConfigError*>(&problem), nullptr);
    EXPECT_EQ(dynamic_cast<const core::MissingError*>(&problem), nullptr);
    EXPECT_THAT(problem.what(), HasSubstr("self-test failed: "));
  }
}

TEST(SelfTest, PassesOnTheWorkspaceOfTheCell) {
  const SelfTestResult result = test_workspace(bench_workspace(), bench(), {});
  EXPECT_TRUE(result.passed) << result.message;
  EXPECT_THAT(result.message, HasSubstr("of 6 objects"));
}

/// A voxel of a layer, and where its brick keeps it.
std::pair<workspace::BrickKey, std::size_t> layer_voxel(const workspace::Workspace& workspace,
                                                        std::int8_t order) {
  for (const workspace::BrickKey key : workspace.bricks()) {
    for (std::size_t i = 0; i < workspace::kBrickVoxels; ++i) {
      if (workspace.brick(key).order[i] == order) return {key, i};
    }
  }
  throw std::runtime_error("no such voxel");
}

// Tries phantom_sensing: a self-test fails while running
TEST(SelfTest, FailsOnAVoxelOfAnotherViscosity) {
  workspace::Workspace broken = bench_workspace();
  const auto [key, at] = layer_voxel(broken, 2);
  broken.edit_brick(key).mu_code[at] -= 1;
  const SelfTestResult result = test_workspace(broken, bench(), {});
  EXPECT_FALSE(result.passed);
  EXPECT_THAT(result.message, HasSubstr("order 2"));
}

TEST(SelfTest, FailsOnAVoxelOfAnotherOrder) {
  workspace::Workspace broken = bench_workspace();
  const auto [key, at] = layer_voxel(broken, 2);
  broken.edit_brick(key).order[at] = 98;
  EXPECT_FALSE(test_workspace(broken, bench(), {}).passed);
}

TEST(SelfTest, FailsOnFluidOfNobody) {
  workspace::Workspace broken = bench_workspace();
  const auto [key, at] = layer_voxel(broken, 3);
  broken.edit_brick(key).object[at] = 0;
  EXPECT_THAT(test_workspace(broken, bench(), {}).message, HasSubstr("belongs to no object"));
}

TEST(SelfTest, FailsOnAnotherCell) {
  runtime::CellConfig other = bench();
  other.voxel_size_m = 0.02;
  EXPECT_THAT(test_workspace(bench_workspace(), other, {}).message, HasSubstr("grid is not the one"));
  other = bench();
  other.objects[0].profile.mu_Pa_s_per_m[1] += 1.0F;
  EXPECT_THAT(test_workspace(bench_workspace(), other, {}).message, HasSubstr("bar, order 2"));
}

TEST(SelfTest, PassesOverObjectsThatTheCellDoesNotKnow) {
  runtime::CellConfig fewer = bench();
  fewer.objects.pop_back();
  const SelfTestResult result = test_workspace(bench_workspace(), fewer, {});
  EXPECT_TRUE(result.passed) << result.message;
  EXPECT_THAT(result.message, HasSubstr("of 5 objects"));
}

}  // namespace
}  // namespace phantom::phantom_sensing::self_test_test

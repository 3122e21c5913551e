#include "components/wva_server/following/following.hpp"

#include <gmock/gmock.h>

#include "components/wva_server/tests/test_cell.hpp"
#include "tests/support/same_content.hpp"

namespace phantom::wva_server {
namespace {

using ::testing::HasSubstr;

/// A leader, and a cell of half the voxel size that follows it.
class FollowingTest : public TestCell {
 protected:
  void SetUp() override {
    TestCell::SetUp();
    leader_.emplace(activated(cell(), 7));
    const auto fine = cell_with("voxel_size_m: 0.01", "voxel_size_m: 0.005");
    own_.emplace(activated(fine, 7));
  }
  /// What the leader's topics say.
  LeaderObjects heard() const {
    LeaderObjects all;
    for (const auto& [id, object] : leader_->objects()) {
      const double error_m = object.config.pose_error_m;
      all[id] = {{id, object.config.name, object.mesh_hash, object.config.X_WO, object.config.colour},
                 error_m > 0.0 ? error_m : -1.0,
                 {}};
    }
    for (const auto& carried : leader_->carried()) all.at(carried.id).carried = carried;
    for (const std::uint16_t id : removed_) all[id] = {.object = {.id = id}};
    return all;
  }
  Following::MeshOf meshes() const {
    return [this](std::uint64_t hash) -> const geometry::TriangleMesh* {
      for (const auto& [id, object] : leader_->objects())
        if (object.mesh_hash == hash && has_meshes_) return &object.mesh_O;
      return nullptr;
    };
  }
  void lead(const WorkspaceCommand& command) {
    const auto change = leader_->apply(command, leader_->workspace().version + 1, {});
    ASSERT_TRUE(change) << change.status().message();
    if (command.operation == WorkspaceOperation::kRemove) removed_.push_back(change->id);
  }
  /// Follows until nothing is left to do; returns the number of commands.
  int follow() {
    for (int commands = 0;; ++commands) {
      EXPECT_LT(commands, 20);
      const auto command = following_.next(heard(), *own_, meshes());
      if (!command || commands == 20) return commands;
      EXPECT_TRUE(Following::is_own(*command));
      if (command->operation == WorkspaceOperation::kAdd) own_->prefer_id(command->id);
      const auto change = own_->apply(*command, own_->workspace().version + 1, {});
      if (!change) following_.refused(change.status().message());
    }
  }
  void expect_alike() const {
    ASSERT_EQ(own_->objects().size(), leader_->objects().size());
    for (const auto& [id, object] : leader_->objects()) {
      const ServedObject& own = own_->objects().at(id);
      EXPECT_EQ(own.config.name, object.config.name);
      // Poses of two cell files differ by rounding, which is no difference.
      EXPECT_LT((own.config.X_WO.translation_m - object.config.X_WO.translation_m).norm(), 3e-6);
      EXPECT_LT((own.config.X_WO.rotation - object.config.X_WO.rotation).norm(), 3e-6);
      EXPECT_EQ(own.carrier.has_value(), object.carrier.has_value());
      EXPECT_EQ(own.mesh_hash, object.mesh_hash);
    }
  }
  static geometry::Pose at(double x_m, double y_m, double z_m, double yaw_rad = 0.0) {
    return {geometry::rotation_from_rpy(0.1, 0.2, yaw_rad), {x_m, y_m, z_m}};
  }

  std::optional<LiveCell> leader_, own_;
  std::vector<std::uint16_t> removed_;
  Following following_;
  bool has_meshes_ = true;
};

TEST_F(FollowingTest, CellsThatAreAlikeNeedNothing) {
  EXPECT_EQ(follow(), 0);
  EXPECT_FALSE(following_.next({}, *own_, meshes())) << "nothing was heard";
}

// The workspace that follows is the one whose cell file has the object there.
TEST_F(FollowingTest, AMoveIsFollowedAndTheGuardCountsInItsOwnVoxels) {
  lead(make_command(WorkspaceOperation::kMove, "ball", 0, at(0.05, -0.1, 0.25, 0.7), "", 2));
  EXPECT_EQ(follow(), 1);
  expect_alike();
  EXPECT_EQ(leader_->objects().at(1).guard_m, 0.02);
  EXPECT_EQ(own_->objects().at(1).guard_m, 0.02) << "four voxels of 5 mm";
  EXPECT_EQ(own_->objects().at(1).config.profile.guard_vox, 4);
  LiveCell fresh = activated(cell());
  ASSERT_TRUE(
      fresh.apply(make_command(WorkspaceOperation::kMove, "ball", 0, at(0.05, -0.1, 0.25, 0.7), "", 4),
                  own_->workspace().version, {}));
  EXPECT_EQ(fresh.content_hash(), own_->content_hash());
  lead(make_command(WorkspaceOperation::kMove, "ball", 0, at(0.05, -0.1, 0.25, 0.7), "", 1));
  EXPECT_EQ(follow(), 1) << "a better known pose";
  EXPECT_EQ(own_->objects().at(1).config.profile.guard_vox, 2);
}

TEST_F(FollowingTest, RemovedAndAddedObjectsAreFollowedUnderTheSameId) {
  lead(make_command(WorkspaceOperation::kRemove, "left post"));
  lead(make_command(
      WorkspaceOperation::kAdd, "", 0, {},
      "{name: new post, mesh: post.stl, mesh_scale: 0.001, pose: {xyz_m: [0.123456789, -0.1, 0.2], "
      "rpy_deg: [10, 20, 33.33333]}}"));
  has_meshes_ = false;
  EXPECT_EQ(follow(), 1) << "the mesh has not come yet";
  has_meshes_ = true;
  EXPECT_GE(follow(), 1);
  expect_alike();
  EXPECT_TRUE(own_->objects().contains(4));
  EXPECT_EQ(follow(), 0);
}

TEST_F(FollowingTest, WhatAnArmCarriesIsCarriedAndPutDown) {
  WorkspaceCommand attach = make_command(WorkspaceOperation::kAttach, "ball");
  attach.arm = "arm", attach.frame = "tool", attach.sets_pose = true, attach.X_FO = at(0, 0, 0.1);
  lead(attach);
  EXPECT_EQ(follow(), 1);
  expect_alike();
  EXPECT_EQ(own_->carried().front().arm, "arm");
  WorkspaceCommand release = make_command(WorkspaceOperation::kRelease, "ball", 0, at(0.1, 0.1, 0.3));
  release.sets_pose = true;
  lead(release);
  EXPECT_EQ(follow(), 1);
  expect_alike();
}

TEST_F(FollowingTest, WhatIsTakenAtAnotherPlaceMeanwhileIsCarriedAsThere) {
  WorkspaceCommand attach = make_command(WorkspaceOperation::kAttach, "ball");
  attach.arm = "arm", attach.frame = "tool", attach.sets_pose = true, attach.X_FO = at(0, 0, 0.1);
  lead(attach);
  EXPECT_EQ(follow(), 1);
  WorkspaceCommand release = make_command(WorkspaceOperation::kRelease, "ball", 0, at(0.1, 0.1, 0.3));
  release.sets_pose = true;
  lead(release);
  attach.X_FO = at(0, 0.02, 0.15);
  lead(attach);
  EXPECT_EQ(follow(), 2) << "put down, and taken as the leader has it";
  expect_alike();
  EXPECT_LT((own_->carried().front().X_FO.translation_m - attach.X_FO.translation_m).norm(), 1e-9);
}

// However the changes came, in whatever order they are followed: after many the cells are alike.
TEST_F(FollowingTest, AfterManyChangesAtOnceTheCellsAreAlike) {
  for (int i = 0; i < 5; ++i)
    lead(make_command(WorkspaceOperation::kMove, i % 2 == 0 ? "ball" : "right post", 0,
                      at(0.02 * i, 0.1, 0.3)));
  lead(make_command(WorkspaceOperation::kRemove, "left post"));
  EXPECT_EQ(follow(), 3);
  expect_alike();
}

// Tries wva_server: an object of the followed server cannot be followed
TEST_F(FollowingTest, WhatIsRefusedIsNamedAndTriedOnceMoreWhenItChanges) {
  lead(make_command(WorkspaceOperation::kMove, "ball", 0, at(0.05, -0.1, 0.25)));
  LeaderObjects beyond = heard();
  beyond.at(1).object.X_WO.translation_m = {9.0, 0.0, 0.0};
  const auto command = following_.next(beyond, *own_, meshes());
  ASSERT_TRUE(command);
  const auto change = own_->apply(*command, own_->workspace().version + 1, {});
  ASSERT_FALSE(change);
  following_.refused(change.status().message());
  EXPECT_THAT(following_.faults(), HasSubstr("ball ("));
  EXPECT_FALSE(following_.next(beyond, *own_, meshes())) << "not again";
  EXPECT_EQ(follow(), 1) << "it is back";
  EXPECT_EQ(following_.faults(), "");
  expect_alike();
}

}  // namespace
}  // namespace phantom::wva_server

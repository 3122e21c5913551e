#include "components/wva_server/cell_changes.hpp"

#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <random>

#include "common/core/errors.hpp"
#include "components/wva_server/service.hpp"
#include "components/wva_server/tests/test_cell.hpp"

namespace phantom::wva_server {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

class Changes : public TestCell {
 protected:
  std::filesystem::path kept() const { return folder_ / "kept.json"; }

  /// What a server that is started now would serve.
  LiveCell started_anew() const {
    ServedCell served = load_served_cell(cell(), kept(), {});
    LiveCell live(served.cell, {}, served.changes);
    const auto change = live.activate(std::move(served.bodies), 1, {}, [](const auto&...) {});
    EXPECT_TRUE(change) << change.status().message();
    return live;
  }
  void carry_out(LiveCell& live, const WorkspaceCommand& command) {
    const auto change = live.apply(command, live.workspace().version + 1, {});
    ASSERT_TRUE(change) << change.status().message();
    write_changes(live.changes(), live.cell(), kept());
  }
  std::string refusal() const {
    try {
      load_served_cell(cell(), kept(), {});
    } catch (const core::ConfigError& error) {
      return error.what();
    }
    return "accepted";
  }
  static geometry::Pose turned(double angle_rad, const Eigen::Vector3d& to_m) {
    return {Eigen::AngleAxisd(angle_rad, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix(), to_m};
  }
  static void expect_same(const LiveCell& a, const LiveCell& b) {
    EXPECT_EQ(a.content_hash(), b.content_hash());
    EXPECT_EQ(a.changes().next_id, b.changes().next_id);
    ASSERT_EQ(a.objects().size(), b.objects().size());
    for (const auto& [id, object] : a.objects()) {
      ASSERT_TRUE(b.objects().contains(id)) << id;
      EXPECT_EQ(object.config.name, b.objects().at(id).config.name);
      EXPECT_EQ(object.mesh_hash, b.objects().at(id).mesh_hash);
      EXPECT_EQ(object.config.X_WO.rotation, b.objects().at(id).config.X_WO.rotation);
      EXPECT_EQ(object.config.X_WO.translation_m, b.objects().at(id).config.X_WO.translation_m);
    }
  }
};

TEST_F(Changes, WithoutAFileTheCellIsServedAsItsFileHasIt) { expect_same(started_anew(), activated(cell())); }

// Tries wva_server: it is killed and started anew
TEST_F(Changes, AServerStartedAnewServesTheCellAsItWas) {
  LiveCell live = activated(cell());
  carry_out(live, make_command(WorkspaceOperation::kMove, "ball", 0, turned(0.7, {0.1, -0.1, 0.2})));
  carry_out(live, make_command(WorkspaceOperation::kRemove, "left post"));
  carry_out(live,
            make_command(WorkspaceOperation::kAdd, "", 0, {},
                         "# a dome\nname: \"dome \\\"2\\\"\"\nprimitive: {sphere: {radius_m: 0.06}}\npose: "
                         "{xyz_m: [0.2, -0.2, 0.2]}\n"));
  expect_same(started_anew(), live);
  carry_out(live, make_command(WorkspaceOperation::kMove, "ball", 0, turned(0.7, {0.1, -0.1, 0.25}), "", 2));
  expect_same(started_anew(), live);
  carry_out(live, make_command(WorkspaceOperation::kMove, "ball", 0, turned(0.7, {0.1, -0.1, 0.2})));
  EXPECT_EQ(live.objects().at(1).config.profile.guard_vox, 2) << "a move without a guard leaves it as it is";
  EXPECT_GT(live.objects().at(1).config.pose_error_m, 0.0);
  EXPECT_EQ(started_anew().objects().at(1).config.pose_error_m, live.objects().at(1).config.pose_error_m);
  expect_same(started_anew(), live);
  carry_out(live, make_command(WorkspaceOperation::kMove, "dome \"2\"", 0, turned(0.2, {-0.2, -0.2, 0.2})));
  expect_same(started_anew(), live);
  LiveCell again = started_anew();
  carry_out(again, make_command(WorkspaceOperation::kRemove, "dome \"2\""));
  EXPECT_EQ(started_anew().changes().next_id, 5U);  // 4 was given away
}

TEST_F(Changes, OnceAllIdsWereGivenThoseOfRemovedObjectsAreGivenAgain) {
  const auto loaded = runtime::load_cell(cell());  // objects 1, 2 and 3
  CellChanges long_since = no_changes(loaded);
  long_since.next_id = 65534;
  LiveCell live(loaded, {}, long_since);
  ASSERT_TRUE(live.activate(runtime::load_bodies(loaded, {}), 1, {}, [](const auto&...) {}));
  const auto add = [&](const std::string& name) {
    carry_out(live, make_command(WorkspaceOperation::kAdd, "", 0, {},
                                 "{name: " + name +
                                     ", primitive: {sphere: {radius_m: 0.03}}, pose: {xyz_m: "
                                     "[0.2, -0.2, 0.2]}}"));
    return live.changes().objects.back().id;
  };
  EXPECT_EQ(add("a"), 65534);
  EXPECT_EQ(add("b"), 4) << "the first that is free";
  carry_out(live, make_command(WorkspaceOperation::kRemove, "b"));
  carry_out(live, make_command(WorkspaceOperation::kRemove, "ball"));  // of the file: its id stays its own
  EXPECT_EQ(add("c"), 5) << "4 went last";
  expect_same(started_anew(), live);
  LiveCell again = started_anew();
  live = std::move(again);
  EXPECT_EQ(add("d"), 6);
}

TEST_F(Changes, AnySequenceOfCommandsIsKept) {
  for (const char* merge : {"highest_viscosity", "latest_object"}) {
    cell_with("voxel_size_m: 0.01", std::string("voxel_size_m: 0.02, merge: ") + merge);
    std::filesystem::remove(kept());
    std::mt19937 random(7);
    const auto pick = [&](int n) { return static_cast<int>(random() % static_cast<unsigned>(n)); };
    LiveCell live = activated(cell());
    for (int step = 0; step < 30; ++step) {
      if (pick(4) == 0 || live.objects().empty()) {
        carry_out(
            live,
            make_command(WorkspaceOperation::kAdd, "", 0, {},
                         "{name: box " + std::to_string(step) +
                             ", primitive: {box: {size_m: [0.1, 0.1, 0.1]}}, pose: {xyz_m: [0, 0, 0.2]}}"));
        continue;
      }
      const auto id = std::next(live.objects().begin(), pick(static_cast<int>(live.objects().size())))->first;
      if (pick(4) == 0) {
        carry_out(live, make_command(WorkspaceOperation::kRemove, "", id));
      } else {
        carry_out(live, make_command(WorkspaceOperation::kMove, "", id,
                                     turned(0.1 * step, {0.02 * pick(10), 0.02 * pick(10), 0.2})));
      }
    }
    expect_same(started_anew(), live);
  }
}

// Tries wva_server: the cell file was edited since
TEST_F(Changes, AreNotMixedWithAnotherCellFile) {
  LiveCell live = activated(cell());
  carry_out(live, make_command(WorkspaceOperation::kRemove, "ball"));
  cell_with("xyz_m: [0.0, 0.0, 0.3]", "xyz_m: [0.0, 0.0, 0.2]");
  EXPECT_THAT(refusal(),
              AllOf(HasSubstr("kept.json"), HasSubstr("cell.yaml"), HasSubstr("remove the first")));
}

// Tries wva_server: the kept changes are damaged
TEST_F(Changes, ThatAreDamagedAreRefusedByName) {
  LiveCell live = activated(cell());
  carry_out(live, make_command(WorkspaceOperation::kMove, "ball", 0, turned(0.7, {0.1, -0.1, 0.2})));
  std::ifstream stream(kept());
  const std::string good{std::istreambuf_iterator<char>(stream), {}};
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string text = good;
    const auto at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    write("kept.json", text.replace(at, from.size(), to));
    return refusal();
  };
  write("kept.json", good.substr(0, good.size() / 2));
  EXPECT_THAT(refusal(), HasSubstr("kept.json"));
  write("kept.json", "");
  EXPECT_THAT(refusal(), HasSubstr("kept.json"));
  EXPECT_THAT(with("\"ball\"", "\"bell\""),
              AllOf(HasSubstr("'bell' (object 1)"), HasSubstr("does not have")));
  EXPECT_THAT(with("\"id\": 1", "\"id\": 0"), AllOf(HasSubstr("kept.json"), HasSubstr("id")));
  EXPECT_THAT(with("\"rotation\": [", "\"rotation\": [0.5, "), HasSubstr("rotation"));
  write("kept.json", good);
  EXPECT_EQ(refusal(), "accepted");
}

// Tries wva_server: the folder of `--keep-changes`
TEST_F(Changes, NeedAFolderFromTheStart) {
  EXPECT_THROW(load_served_cell(cell(), folder_ / "no such folder" / "kept.json", {}), core::MissingError);
  EXPECT_NO_THROW(load_served_cell(cell(), folder_ / "kept.json", {}));
}

TEST_F(Changes, ThatCannotBeWrittenLeaveTheOldFile) {
  LiveCell live = activated(cell());
  const auto nowhere = folder_ / "no such folder" / "kept.json";
  try {
    write_changes(live.changes(), live.cell(), nowhere);
    FAIL();
  } catch (const core::ConfigError& error) {
    EXPECT_THAT(error.what(), AllOf(HasSubstr(nowhere.string()), HasSubstr("No such file")));
  }
}

}  // namespace
}  // namespace phantom::wva_server

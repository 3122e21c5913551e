// A surveyed object comes into the running system: into the workspace, with its guard, and into the percept.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "tests/end_to_end/running_system.hpp"
#include "tests/end_to_end/workspace_observer.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/own_domain.hpp"

namespace phantom::end_to_end {
namespace {

using testing::AllOf;
using testing::HasSubstr;

/// `workspace_survey …` as a person would type it, in the system's domain.
test::Said survey(const std::string& words, const RunningSystem& system) {
  return test::run_line(PHANTOM_BIN_DIR "/workspace_survey " + words + " --deployment " +
                        (system.folder() / "topology.yaml").string() + " --domain " +
                        std::to_string(system.network().domain));
}

struct Voxels {
  std::size_t solid = 0, guard = 0;
};
Voxels voxels_of(const workspace::Workspace& workspace, std::uint16_t object) {
  Voxels voxels;
  std::vector<std::uint16_t> objects(workspace::kBrickVoxels);
  for (const workspace::BrickKey key : workspace.bricks()) {
    const auto brick = workspace.brick(key);
    brick.copy_objects(objects.data());
    for (std::uint32_t i = 0; i < workspace::kBrickVoxels; ++i) {
      if (objects[i] != object) continue;
      const std::int8_t order = brick.order[i];
      voxels.solid += order == workspace::kOrderBoundary || order == workspace::kOrderInterior;
      voxels.guard += order == workspace::kOrderGuard;
    }
  }
  return voxels;
}

// Tries workspace_survey: the server refuses
TEST(RunningDemo, ASurveyedObjectIsInTheWorkspaceWithItsGuardAndIsFeltAndARefusedOneAddsNothing) {
  RunningSystem system(0.0);
  WorkspaceObserver observer(system.network());
  ASSERT_TRUE(eventually(
      [&] { return observer.felt_version() != 0 && observer.felt_version() == observer.version(); }, 60.0))
      << system.output();

  // Where the arm comes by: in the midst of what it feels there, once more at each reach.
  ASSERT_TRUE(
      eventually([&] { return observer.percept().object() != 0 && observer.percept().mu() > 0; }, 120.0))
      << system.output();
  const auto place = observer.percept().position_m();
  char pose[96];
  std::snprintf(pose, sizeof pose, "'%.3f %.3f %.3f 0 0 20'", place.x(), place.y(), place.z() - 0.02);
  const std::string file = (system.folder() / "brick.csv").string();
  const test::Said simulated =
      survey(std::string("simulate --part brick --pose ") + pose + " --out " + file, system);
  ASSERT_EQ(simulated.exit_code, 0) << simulated.output;

  // Refused: nothing is added.
  const std::uint64_t version = observer.version();
  const std::size_t objects = observer.objects().size();
  const std::string examples = PHANTOM_SOURCE_DIR "/deploy/parts/measurements/";
  const test::Said bad = survey("fit --send --measurements " + examples + "refused_bad_range.csv", system);
  EXPECT_EQ(bad.exit_code, 1) << bad.output;
  EXPECT_THAT(bad.output, HasSubstr("refused:"));
  const test::Said several =
      survey("fit --send --measurements " + examples + "refused_several_poses.csv", system);
  EXPECT_EQ(several.exit_code, 1) << several.output;
  std::ofstream(system.folder() / "nan.csv") << "face,node,range_mm,pan_deg,tilt_deg\nA,1,nan,0,45\n";
  const test::Said nan =
      survey("fit --send --measurements " + (system.folder() / "nan.csv").string(), system);
  EXPECT_EQ(nan.exit_code, 2) << nan.output;
  EXPECT_THAT(nan.output, HasSubstr("nan.csv:2: range_mm is 'nan'"));

  // Accepted.
  const test::Said fitted = survey("fit --send --name surveyed_brick --measurements " + file, system);
  ASSERT_EQ(fitted.exit_code, 0) << fitted.output;
  EXPECT_THAT(fitted.output,
              AllOf(HasSubstr("part:        brick"), HasSubstr("workspace:   added 'surveyed_brick'")));
  ASSERT_TRUE(
      eventually([&] { return observer.version() > version && observer.id_of("surveyed_brick") != 0; }));
  EXPECT_EQ(observer.objects().size(), objects + 1) << "the refused ones added nothing";
  const std::uint16_t id = observer.id_of("surveyed_brick");
  const Voxels voxels = voxels_of(*observer.workspace(), id);
  EXPECT_GT(voxels.solid, 5000u) << "a litre in voxels of 5 mm";
  EXPECT_GT(voxels.guard, 1000u);
  EXPECT_TRUE(
      eventually([&] { return observer.percept().object() == id && observer.percept().mu() > 0; }, 120.0))
      << "the percept is of it when the arm comes by: " << system.output();

  // Under the same name once more: refused by the server; moved, with a guard of its own.
  const test::Said again = survey("fit --send --name surveyed_brick --measurements " + file, system);
  EXPECT_EQ(again.exit_code, 1) << again.output;
  EXPECT_THAT(again.output, HasSubstr("is there already"));
  const test::Said moved =
      survey("fit --send --move surveyed_brick --measurements " + examples + "brick.csv", system);
  EXPECT_EQ(moved.exit_code, 0) << moved.output;
  EXPECT_THAT(moved.output, AllOf(HasSubstr("moved 'surveyed_brick'"), HasSubstr("guard 2 voxels")));
  EXPECT_TRUE(
      eventually([&] { return std::abs(observer.objects().at(id).X_WO().position_m().x() - 0.05) < 0.005; }));
  system.stop();
  EXPECT_EQ(system.wait(), 0) << system.output();
}

// Tries workspace_survey: nobody answers
TEST(WithoutAServer, SendingEndsWithThreeAndSaysSo) {
  const std::string command = PHANTOM_BIN_DIR "/workspace_survey fit --send --timeout-s 0.5 --domain " +
                              std::to_string(test::own_domain()) +
                              " --measurements " PHANTOM_SOURCE_DIR
                              "/deploy/parts/measurements/brick.csv > /dev/null 2>&1";
  const int status = std::system(command.c_str());
  EXPECT_EQ(WEXITSTATUS(status), 3);
}

}  // namespace
}  // namespace phantom::end_to_end

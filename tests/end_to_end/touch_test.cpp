// A fixture that stands 12 mm off is touched by the running arm and corrected: the model, the guard
// meanwhile, and the percept afterwards.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>

#include "common/messages/codecs/teleoperation_codec.hpp"
#include "common/runtime/cell/cell.hpp"
#include "tests/end_to_end/running_system.hpp"
#include "tests/end_to_end/workspace_observer.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/own_domain.hpp"

namespace phantom::end_to_end {
namespace {

using testing::AllOf;
using testing::HasSubstr;

constexpr double kHalf_m[] = {0.06, 0.04, 0.03};  // of the fixture

std::string survey_line(const std::string& words, const RunningSystem& system) {
  return std::string(PHANTOM_BIN_DIR "/workspace_survey ") + words + " --deployment " +
         (system.folder() / "topology.yaml").string() + " --domain " +
         std::to_string(system.network().domain);
}

geometry::Pose pose_of(const msg::WorkspaceObject& object) {
  const auto sample = messages::from_idl(object);
  if (!sample) throw std::runtime_error(sample.status().message());
  return sample->X_WO;
}

/// The greatest distance of a corner of the fixture at one pose from the same at another.
double apart_m(const geometry::Pose& a, const geometry::Pose& b) {
  double worst_m = 0.0;
  for (int i = 0; i < 8; ++i) {
    const Eigen::Vector3d corner((i & 1 ? 1 : -1) * kHalf_m[0], (i & 2 ? 1 : -1) * kHalf_m[1],
                                 (i & 4 ? 1 : -1) * kHalf_m[2]);
    worst_m = std::max(worst_m, (a * corner - b * corner).norm());
  }
  return worst_m;
}

/// What is felt while the arm really touches the fixture's front: the greatest μ, by the version that it
/// rests on.
class FeltAtTheFront {
 public:
  explicit FeltAtTheFront(const core::NetworkOptions& network)
      : participant_("contact_observer", network),
        states_(participant_, dds::kSlaveState,
                [this](const msg::SlaveState& m, const dds::SampleInfo&) {
                  const std::lock_guard lock(mutex_);
                  touches_ = m.contact() && m.contact_object() == 2 && m.contact_point_m().y() < -0.03 &&
                             m.contact_point_m().z() < 0.25;
                }),
        percepts_(participant_, dds::kPercept, [this](const msg::Percept& m, const dds::SampleInfo&) {
          const std::lock_guard lock(mutex_);
          if (!touches_ || m.object() != 2) return;
          auto& most = most_mu_[m.workspace_version()];
          most = std::max(most, m.mu());
        }) {}
  /// While percepts rested on this version, or on those before it; 0: no contact with the front then.
  double most_mu(std::uint64_t version) {
    const std::lock_guard lock(mutex_);
    const auto found = most_mu_.find(version);
    return found == most_mu_.end() ? 0.0 : found->second;
  }
  double most_mu_before(std::uint64_t version) {
    const std::lock_guard lock(mutex_);
    double most = 0.0;
    for (const auto& [earlier, mu] : most_mu_) most = earlier < version ? std::max(most, mu) : most;
    return most;
  }

 private:
  std::mutex mutex_;
  bool touches_ = false;
  std::map<std::uint64_t, double> most_mu_;
  dds::Participant participant_;
  dds::Reader<msg::SlaveState> states_;
  dds::Reader<msg::Percept> percepts_;
};

/// The share of the real fixture's solid that the model has as solid, too, counted in voxels.
double solid_where_it_is(const workspace::Workspace& workspace, const geometry::Pose& real_WO) {
  int inside = 0, solid = 0;
  const auto& grid = workspace.grid();
  for (double x = -kHalf_m[0] + 0.003; x < kHalf_m[0] - 0.002; x += 0.003) {
    for (double y = -kHalf_m[1] + 0.003; y < kHalf_m[1] - 0.002; y += 0.003) {
      for (double z = -kHalf_m[2] + 0.003; z < kHalf_m[2] - 0.002; z += 0.003) {
        const Eigen::Vector3d p_vox = grid.to_voxels(real_WO * Eigen::Vector3d(x, y, z));
        const workspace::Index3 v{static_cast<std::int32_t>(p_vox.x()), static_cast<std::int32_t>(p_vox.y()),
                                  static_cast<std::int32_t>(p_vox.z())};
        const auto order = workspace.order(v);
        ++inside;
        solid += order == workspace::kOrderBoundary || order == workspace::kOrderInterior ? 1 : 0;
      }
    }
  }
  return static_cast<double>(solid) / inside;
}

TEST(RunningTouch, AFixtureThatStandsTwelveMillimetresOffIsTouchedCorrectedAndFeltWhereItIs) {
  RunningSystem system(0.0, "touch", "", {{"master_io", {{"percept: alternate", "percept: on"}}}});
  const auto cell = runtime::load_cell(PHANTOM_SOURCE_DIR "/deploy/cells/touch_bench/cell.yaml");
  const runtime::ObjectConfig& fixture = cell.objects.at(1);
  const geometry::Pose real_WO = fixture.X_WO * fixture.X_deviation;
  ASSERT_GT(apart_m(fixture.X_WO, real_WO), 0.012);
  WorkspaceObserver observer(system.network());
  FeltAtTheFront felt(system.network());
  ASSERT_TRUE(eventually(
      [&] { return observer.felt_version() != 0 && observer.felt_version() == observer.version(); }, 60.0))
      << system.output();
  ASSERT_TRUE(eventually([&] { return observer.id_of("fixture") == 2; }));
  const std::uint64_t before = observer.version();
  const double solid_before = solid_where_it_is(*observer.workspace(), real_WO);

  // Not there; then touched, with nobody who says yes: shown, the guard widened, the pose as it was. Of four
  // touches, wherever the arm is in its round, one is not of the top, where the model is right.
  const test::Said absent = test::run_line(survey_line("touch --object pump --timeout-s 20", system));
  EXPECT_EQ(absent.exit_code, 2) << absent.output;
  EXPECT_THAT(absent.output, AllOf(HasSubstr("there is no 'pump'"), HasSubstr("fixture")));
  const test::Said shown =
      test::run_line("echo n | " + survey_line("touch --object fixture --touches 4", system));
  ASSERT_EQ(shown.exit_code, 0) << shown.output;
  EXPECT_THAT(shown.output,
              AllOf(HasSubstr("touch 1"), HasSubstr("touch 4"), HasSubstr("before:"), HasSubstr("after:"),
                    HasSubstr("open:"), HasSubstr("apply this change? [y/N]"), HasSubstr("not applied"),
                    HasSubstr("the model is contradicted: its guard is")));
  ASSERT_TRUE(eventually([&] { return observer.version() > before; }));
  EXPECT_LT(apart_m(pose_of(observer.objects().at(2)), fixture.X_WO), 1e-9) << "not applied";
  std::size_t guard = 0;
  const auto widened = observer.workspace();
  for (const workspace::BrickKey key : widened->bricks()) {
    const auto brick = widened->brick(key);
    for (std::uint32_t i = 0; i < workspace::kBrickVoxels; ++i)
      guard += brick.order[i] == workspace::kOrderGuard ? 1 : 0;
  }
  EXPECT_GT(guard, 5'000u) << "the guard covers where it may stand";

  // Seven touches have all six spots; applied.
  ASSERT_TRUE(eventually([&] { return observer.felt_version() == observer.version(); }));
  const std::uint64_t shown_version = observer.version();
  const std::string file = (system.folder() / "touch.json").string();
  const test::Said applied =
      test::run_line(survey_line("touch --object fixture --touches 7 --apply --json " + file, system));
  std::cout << applied.output;
  ASSERT_EQ(applied.exit_code, 0) << applied.output << system.output();
  EXPECT_THAT(applied.output, HasSubstr("workspace:   moved 'fixture'"));
  ASSERT_TRUE(eventually(
      [&] { return observer.version() > shown_version && observer.felt_version() == observer.version(); }));
  const geometry::Pose corrected_WO = pose_of(observer.objects().at(2));
  std::cout << "off by " << 1e3 * apart_m(fixture.X_WO, real_WO) << " mm before, "
            << 1e3 * apart_m(corrected_WO, real_WO) << " mm after\n";
  const auto json = nlohmann::json::parse(read_text(file));
  EXPECT_TRUE(json.at("applied"));
  EXPECT_GE(json.at("determined").size(), 3u);
  EXPECT_LT((corrected_WO.translation_m - real_WO.translation_m).norm(), 0.002);
  EXPECT_LT(apart_m(corrected_WO, real_WO), json.at("worst_point_off_m").get<double>());

  // The model's solid is where the real one is, and what is felt is felt on that version.
  const double solid_after = solid_where_it_is(*observer.workspace(), real_WO);
  std::cout << "of the real solid the model had " << 100 * solid_before << " %, now " << 100 * solid_after
            << " %\n";
  EXPECT_LT(solid_before, 0.97);
  EXPECT_GT(solid_after, 0.995);
  // In contact with the real front, which stood 7 mm before the model's, the fluid of layer 1 was felt; now
  // the skin.
  const std::uint64_t version = observer.version();
  ASSERT_TRUE(eventually([&] { return felt.most_mu(version) > 0.0; }, 60.0)) << system.output();
  EXPECT_TRUE(eventually([&] { return felt.most_mu(version) > 99.0; }, 60.0)) << felt.most_mu(version);
  EXPECT_LT(felt.most_mu_before(version), 40.0);
  EXPECT_GT(felt.most_mu_before(version), 30.0);

  // Touched again, it agrees.
  const test::Said agrees = test::run_line(survey_line("touch --object fixture --touches 6", system));
  EXPECT_EQ(agrees.exit_code, 0) << agrees.output;
  EXPECT_THAT(agrees.output, HasSubstr("nothing to change"));
  system.stop();
  EXPECT_EQ(system.wait(), 0) << system.output();
}

// Tries workspace_survey: nobody is heard while an object is to be touched
TEST(TouchWithoutAServer, EndsWithThreeAndSaysSo) {
  const test::Said nobody = test::run_line(
      std::string(PHANTOM_BIN_DIR "/workspace_survey touch --object pump --timeout-s 0.5 --domain ") +
      std::to_string(test::own_domain()));
  EXPECT_EQ(nobody.exit_code, 3) << nobody.output;
  EXPECT_THAT(nobody.output, HasSubstr("no object received from wva_server"));
}

}  // namespace
}  // namespace phantom::end_to_end

// A body that the model has elsewhere is touched: the percept is marked, the place is kept, and a touch of
// the body where it is then begins with it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <mutex>

#include "common/messages/codecs/percept_codec.hpp"
#include "tests/end_to_end/running_system.hpp"
#include "tests/end_to_end/workspace_observer.hpp"
#include "tests/support/child_process.hpp"

namespace phantom::end_to_end {
namespace {

using testing::HasSubstr;

/// Follows the doubts of the model, and whether percepts are marked by them.
class DoubtObserver {
 public:
  explicit DoubtObserver(const core::NetworkOptions& network)
      : participant_("doubt_observer", network),
        doubts_(participant_, dds::kModelDoubt,
                [this](const msg::ModelDoubt& message, const dds::SampleInfo&) {
                  const auto doubt = messages::from_idl(message);
                  const std::lock_guard lock(mutex_);
                  if (doubt) kept_[doubt->place] = *doubt;
                }),
        percepts_(participant_, dds::kPercept, [this](const msg::Percept& message, const dds::SampleInfo&) {
          const std::lock_guard lock(mutex_);
          marked_ = marked_ || message.condition() == msg::PerceptCondition::PERCEPT_MODEL_IN_DOUBT;
        }) {}
  std::map<std::uint32_t, messages::ModelDoubt> kept() {
    const std::lock_guard lock(mutex_);
    return kept_;
  }
  bool marked() {
    const std::lock_guard lock(mutex_);
    return marked_;
  }

 private:
  std::mutex mutex_;
  std::map<std::uint32_t, messages::ModelDoubt> kept_;
  bool marked_ = false;
  dds::Participant participant_;
  dds::Reader<msg::ModelDoubt> doubts_;
  dds::Reader<msg::Percept> percepts_;
};

test::Said run(const std::string& line, const RunningSystem& system) {
  return test::run_line(std::string(PHANTOM_BIN_DIR "/") + line + " --deployment " +
                        (system.folder() / "topology.yaml").string() + " --domain " +
                        std::to_string(system.network().domain));
}

// The fixture's top, 26 cm above the floor, is 6 cm above the table.
TEST(RunningDoubt, ABodyThatTheModelHasElsewhereIsReportedKeptAndTouched) {
  RunningSystem system(0.0, "touch", "synthetic_viewer",
                       {{"master_io", {{"percept: alternate", "percept: on"}}}});
  WorkspaceObserver observer(system.network());
  DoubtObserver doubts(system.network());
  ASSERT_TRUE(eventually(
      [&] { return observer.felt_version() != 0 && observer.felt_version() == observer.version(); }, 60.0))
      << system.output();
  EXPECT_TRUE(doubts.kept().empty()) << "12 mm are within the model's error";
  const test::Said moved =
      run("wva_server command move --object fixture --pose '0.3 0.3 0.23 0 0 0'", system);
  ASSERT_EQ(moved.exit_code, 0) << moved.output;

  const auto on_top = [](const messages::ModelDoubt& doubt) {
    return doubt.kind == percept::DoubtKind::kForceInFreeSpace && std::abs(doubt.position_m[2] - 0.26) < 0.01;
  };
  ASSERT_TRUE(eventually(
      [&] {
        for (const auto& [place, doubt] : doubts.kept())
          if (on_top(doubt)) return true;
        return false;
      },
      60.0))
      << system.output();
  EXPECT_TRUE(eventually([&] { return doubts.marked(); }));
  for (const auto& [place, doubt] : doubts.kept()) {
    EXPECT_TRUE(doubt.located);
    EXPECT_EQ(doubt.link_name, "probe");
    EXPECT_GT(doubt.force_N, 0.0);
  }
  const auto no_longer = [&] {
    for (const auto& [place, doubt] : doubts.kept())
      if (on_top(doubt) && !doubt.holds) return true;
    return false;
  };
  EXPECT_TRUE(eventually(no_longer, 60.0)) << "the arm comes away";

  // Who joins later has the places, too.
  const test::Said back = run("wva_server command move --object fixture --pose '0 0 0.23 0 0 0'", system);
  ASSERT_EQ(back.exit_code, 0) << back.output;
  const test::Said touched =
      run("workspace_survey touch --object fixture --kept --touches 1 --json -", system);
  EXPECT_EQ(touched.exit_code, 0) << touched.output;
  const test::Said told =
      run("workspace_survey touch --object fixture --kept --touches 1 --wait-s 1 < /dev/null", system);
  EXPECT_THAT(told.output, HasSubstr("kept:        a contact at"));
  system.stop();
  EXPECT_EQ(system.wait(), 0) << system.output();
}

}  // namespace
}  // namespace phantom::end_to_end

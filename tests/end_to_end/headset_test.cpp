// The system led by a headset's controller: a page over the scene stream, the viewer that serves its hand,
// and the simulated arm; and what becomes of the arm as page, headset or viewer fail.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <csignal>
#include <fstream>
#include <iostream>
#include <mutex>
#include <optional>
#include <regex>
#include <thread>

#include "common/core/clock.hpp"
#include "common/dds/endpoints/endpoint.hpp"
#include "common/robot/kinematics/jacobian.hpp"
#include "common/runtime/cell/arm_model.hpp"
#include "common/runtime/cell/cell.hpp"
#include "components/synthetic_viewer/page/tests/raw_client.hpp"
#include "components/synthetic_viewer/stream/tests/hand_messages.hpp"
#include "tests/end_to_end/running_system.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/late_sleeper.hpp"

namespace phantom::end_to_end {
namespace {

using synthetic_viewer::test::RawClient;
using web::test::client_frame;

constexpr double kSilent_s = 0.2;                            // of the viewer, here: the host may be busy
constexpr double kStaleness_s = 0.1;                         // of master_io, in hot_cell_headset.yaml
constexpr double kThreadsOnTheWay = 10.0, kPeriods_s = 0.1;  // from the failure to the test's knowledge of it
constexpr double kSpeed_m_s = 0.05;
constexpr double kFarthest_m = 0.15;  // of the hand, from where it began
constexpr double kHolds_rad = 0.01, kMoves_rad = 0.02;

/// A page in a headset: sends at 90 Hz where its controller is, which moves as it is told.
class Headset {
 public:
  explicit Headset(int stream_port)
      : client_(stream_port), thread_([this](const std::stop_token& stop) { run(stop); }) {}

  void ask() { client_.put(client_frame(1, R"({"hand":1})")); }
  /// Reads on until it is told so; false after a minute.
  bool told(const std::string& word) {
    return client_.read_until([&] { return client_.scene.hand == word; });
  }
  /// Returns what it was told last.
  std::string word() {
    const int alive = client_.scene.alive_count;
    client_.read_until([&] { return client_.scene.alive_count > alive; });
    return client_.scene.hand;
  }

  std::atomic<double> hand_m_s{0.0};  ///< along x of W
  std::atomic<bool> sends{true}, tracked{true}, grip{false};
  std::atomic<core::Nanoseconds> sent_ns{0};
  std::atomic<double> place_m{0.0};

 private:
  void run(const std::stop_token& stop) {
    synthetic_viewer::test::HandMessage message;
    core::Nanoseconds last_ns = core::monotonic_ns();
    while (!stop.stop_requested()) {
      std::this_thread::sleep_for(std::chrono::milliseconds(11));
      const core::Nanoseconds now_ns = core::monotonic_ns();
      // A hold-up is none of the hand's motion, and it goes to and fro: the arm needs room.
      message.position_m.x() += hand_m_s * std::min(0.02, core::seconds(now_ns - last_ns));
      if (message.position_m.x() * hand_m_s > kFarthest_m * std::abs(hand_m_s)) hand_m_s = -hand_m_s;
      place_m = message.position_m.x();
      last_ns = now_ns;
      if (!sends) continue;
      ++message.number;
      message.page_s = core::seconds(now_ns);
      message.tracked = tracked;
      message.grip = grip;
      sent_ns = now_ns;
      client_.put(client_frame(2, synthetic_viewer::test::hand_message(message)));
    }
  }
  RawClient client_;
  std::jthread thread_;
};

class HeadsetSystem : public testing::Test {
 protected:
  HeadsetSystem() {
    std::string parameters = read_text(PHANTOM_SOURCE_DIR "/deploy/cartesian/headset_viewer.yaml");
    parameters = test::replaced(parameters, "port: 8080", "port: 0");
    parameters =
        test::replaced(parameters, "hand_silent_s: 0.1", "hand_silent_s: " + std::to_string(kSilent_s));
    std::ofstream(system_.folder() / "viewer.yaml") << parameters;
    start_viewer();
  }
  void TearDown() override {
    headset_.reset();
    if (HasFailure())
      std::cerr << system_.output() << read_text(system_.report() / "logs/master_io.log")
                << viewer_->output();
  }
  void start_viewer() {
    viewer_ = std::make_unique<test::Process>(
        std::vector<std::string>{PHANTOM_BIN_DIR "/synthetic_viewer", "--deployment",
                                 (system_.folder() / "topology.yaml").string(), "--domain",
                                 std::to_string(system_.network().domain), "--config",
                                 (system_.folder() / "viewer.yaml").string()},
        system_.folder() / ("viewer" + std::to_string(++viewers_) + ".log"));
  }
  void open_page() {
    std::smatch port;
    std::string log;
    ASSERT_TRUE(eventually(
        [&] {
          log = viewer_->output();
          return std::regex_search(log, port, std::regex("live pictures and events: port (\\d+)"));
        },
        90.0))
        << log;
    headset_ = std::make_unique<Headset>(std::stoi(port[1]));
    headset_->ask();
  }
  /// Has the hand lead, as often as it is let go since the host is too busy, until `enough`.
  bool lead_until(const std::function<bool()>& enough, double longest_s = 240.0) {
    return eventually(
        [&] {
          const std::string word = headset_->word();
          if (word == "free") headset_->ask();
          if (word != "leads" && word != "not_coupled") headset_->grip = word == "ready";
          return word == "leads" && enough();
        },
        longest_s);
  }
  bool leads() {
    return lead_until([] { return true; });
  }
  std::vector<double> pose() {
    const std::lock_guard lock(mutex_);
    if (!slave_) return {};
    return {slave_->position_rad().begin(), slave_->position_rad().begin() + slave_->joint_count()};
  }
  Eigen::Vector3d tool_m() {
    core::JointArray q{};
    std::ranges::copy(pose(), q.begin());
    robot::LinkPoses X_WL;
    arm_.link_poses(q, X_WL);
    return robot::tool_pose(arm_, X_WL).translation_m;
  }
  double moved_rad(const std::vector<double>& from) {
    const std::vector<double> now = pose();
    double most = 0.0;
    for (std::size_t j = 0; j < from.size(); ++j) most = std::max(most, std::abs(from[j] - now[j]));
    return most;
  }
  double speed_m_s() {
    const std::lock_guard lock(mutex_);
    return slave_->tool_speed_m_s();
  }
  /// The hand moves, and the arm with it, when `fail` makes something fail at `failed_ns`: master_io lets go
  /// within `bound_s`, the arm comes to rest, and holds whatever the hand does then.
  void expect_let_go(const char* what, double bound_s, const std::function<core::Nanoseconds()>& fail) {
    headset_->hand_m_s = kSpeed_m_s;
    ASSERT_TRUE(lead_until([&] { return speed_m_s() > 0.01; })) << what << ": " << headset_->word();
    let_go_ns_ = 0;
    test::LateSleeper late;
    const core::Nanoseconds failed_ns = fail();
    ASSERT_TRUE(eventually([&] { return let_go_ns_ != 0; })) << what;
    const double after_s = core::seconds(let_go_ns_ - failed_ns);
    std::cout << what << ": let go " << 1e3 * after_s << " ms after\n";
    EXPECT_LT(after_s, bound_s + kPeriods_s + kThreadsOnTheWay * late.greatest_s()) << what;
    EXPECT_TRUE(eventually([&] { return speed_m_s() < 0.005; })) << what;
    const std::vector<double> held = pose();
    std::this_thread::sleep_for(std::chrono::seconds(1));
    EXPECT_LT(moved_rad(held), kHolds_rad) << what << ": the arm holds";
    EXPECT_FALSE(valid_) << what;
  }

  const runtime::CellConfig cell_ = runtime::load_cell(PHANTOM_SOURCE_DIR "/deploy/cells/hot_cell/cell.yaml");
  const robot::SerialArm arm_ = runtime::load_arm(cell_.arm());
  std::mutex mutex_;
  std::optional<msg::SlaveState> slave_;
  std::atomic<bool> valid_{false};
  std::atomic<core::Nanoseconds> let_go_ns_{0};
  int viewers_ = 0;
  RunningSystem system_{0.0, "headset", "synthetic_viewer"};
  std::unique_ptr<test::Process> viewer_;
  std::unique_ptr<Headset> headset_;
  dds::Participant participant_{"headset_test", system_.network()};
  dds::Reader<msg::SlaveState> slaves_{participant_, dds::kSlaveState,
                                       [this](const msg::SlaveState& state, const dds::SampleInfo&) {
                                         const std::lock_guard lock(mutex_);
                                         slave_ = state;
                                       }};
  dds::Reader<msg::HapticDeviceWrench> wrenches_{
      participant_, dds::kHapticDeviceWrench,
      [this](const msg::HapticDeviceWrench& wrench, const dds::SampleInfo& info) {
        if (valid_ && !wrench.valid() && let_go_ns_ == 0) let_go_ns_ = info.received_ns;
        valid_ = wrench.valid();
      }};
};

// Tries synthetic_viewer: no poses come of a controller that leads
// Tries synthetic_viewer: a controller that leads is not tracked
// Tries synthetic_viewer: the page of a controller that leads goes
TEST_F(HeadsetSystem, TheControllerLeadsTheArmAndTheArmHoldsWhateverFails) {
  open_page();
  ASSERT_TRUE(leads()) << headset_->word();
  const std::vector<double> before = pose();
  const Eigen::Vector3d tool_before_m = tool_m();
  const double hand_before_m = headset_->place_m;
  headset_->hand_m_s = kSpeed_m_s;
  ASSERT_TRUE(
      lead_until([&] { return moved_rad(before) > kMoves_rad && tool_m().x() > tool_before_m.x() + 0.04; }));
  headset_->hand_m_s = 0.0;
  EXPECT_TRUE(eventually([&] { return speed_m_s() < 0.002; }));
  const Eigen::Vector3d tool_moved_m = tool_m() - tool_before_m;
  std::cout << "hand " << headset_->place_m - hand_before_m << " m along x, tool " << tool_moved_m.transpose()
            << " m\n";
  EXPECT_GT(tool_moved_m.x(), 0.95 * tool_moved_m.norm()) << "the way that the hand went";

  // The button let go: the arm holds, wherever the hand goes, and nothing jumps as it goes on from there.
  ASSERT_TRUE(leads());
  headset_->grip = false;
  ASSERT_TRUE(headset_->told("ready"));
  std::vector<double> held = pose();
  headset_->hand_m_s = -0.3;
  std::this_thread::sleep_for(std::chrono::seconds(1));
  headset_->hand_m_s = 0.0;
  EXPECT_LT(moved_rad(held), kHolds_rad);
  ASSERT_TRUE(leads());
  std::this_thread::sleep_for(std::chrono::seconds(1));
  EXPECT_LT(moved_rad(held), kHolds_rad) << "nothing jumps";

  expect_let_go("poses that stop", kSilent_s, [&] {
    headset_->sends = false;
    return headset_->sent_ns.load();
  });
  EXPECT_THAT(headset_->word(), testing::AnyOf("silent", "free"));
  headset_->ask();  // it was forgotten, maybe
  held = pose();
  headset_->sends = true;  // the button is held as it was
  std::this_thread::sleep_for(std::chrono::seconds(2));
  EXPECT_EQ(headset_->word(), "clutch_in");
  EXPECT_LT(moved_rad(held), kHolds_rad) << "the button was not let go";

  expect_let_go("a controller out of sight", 0.0, [&] {
    headset_->tracked = false;
    return core::monotonic_ns();
  });
  EXPECT_EQ(headset_->word(), "untracked");
  headset_->tracked = true;

  expect_let_go("a page that is gone", 0.0, [&] {
    headset_.reset();
    return core::monotonic_ns();
  });
  open_page();

  expect_let_go("a viewer that hangs", kStaleness_s, [&] {
    viewer_->signal(SIGSTOP);
    return core::monotonic_ns();
  });
  viewer_->signal(SIGCONT);
  ASSERT_TRUE(leads());

  expect_let_go("a viewer that dies", kStaleness_s, [&] {
    viewer_->signal(SIGKILL);
    return core::monotonic_ns();
  });
  headset_.reset();
  start_viewer();
  open_page();
  EXPECT_TRUE(leads()) << headset_->word();
  headset_.reset();
  system_.stop();
  EXPECT_EQ(system_.wait(), 0) << system_.output();
}

}  // namespace
}  // namespace phantom::end_to_end

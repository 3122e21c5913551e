// Real processes: which signals end slave_io in order, and what becomes of a stop if its file goes away.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <functional>
#include <mutex>
#include <optional>
#include <utility>

#include "common/dds/endpoints/endpoint.hpp"
#include "tests/processes/running_process.hpp"
#include "tests/support/eventually.hpp"
#include "tests/support/files.hpp"
#include "tests/support/own_domain.hpp"

namespace phantom::processes {
namespace {

using phantom::test::eventually;

class StopKept : public testing::Test {
 protected:
  StopKept()
      : folder_(test::new_folder()),
        state_(folder_ / "state"),
        network_{.domain = test::own_domain(),
                 .qos_profiles = PHANTOM_SOURCE_DIR "/deploy/qos/phantom.xml",
                 .interfaces = {"127.0.0.1"}},
        participant_("stop_kept_test", network_),
        slaves_(participant_, dds::kSlaveState, [this](const msg::SlaveState& state, const dds::SampleInfo&) {
          const std::lock_guard lock(mutex_);
          slave_ = state;
        }) {}

  RunningProcess::Options options(const std::string& state = "state") const {
    return {.arguments = {"--deployment", write_topology(folder_).string(), "--domain",
                          std::to_string(network_.domain), "--state-dir", (folder_ / state).string()}};
  }
  std::filesystem::path file() const {
    return state_ / ("slave_io.domain-" + std::to_string(network_.domain) + ".stop");
  }
  bool slave_is(msg::LinkState state) {
    const std::lock_guard lock(mutex_);
    return slave_ && slave_->state() == state;
  }
  // Waits until a new process reports a state.
  bool is_stopped_from_its_start() {
    {
      const std::lock_guard lock(mutex_);
      slave_.reset();
    }
    const bool heard = eventually([&] {
      const std::lock_guard lock(mutex_);
      return slave_.has_value();
    });
    return heard && slave_is(msg::LinkState::LINK_STOPPED);
  }
  double speed_rad_s() {
    const std::lock_guard lock(mutex_);
    double speed = 0.0;
    if (!slave_) return speed;
    for (std::size_t j = 0; j < slave_->joint_count(); ++j)
      speed = std::max(speed, std::abs(slave_->velocity_rad_s()[j]));
    return speed;
  }

  const std::filesystem::path folder_, state_;
  core::NetworkOptions network_;
  std::mutex mutex_;
  std::optional<msg::SlaveState> slave_;
  dds::Participant participant_;
  dds::Reader<msg::SlaveState> slaves_;
};

// Tries slave_io: the file of the stop is removed
TEST_F(StopKept, AStopWhoseFileGoesAwayInUseIsInForceInTheNextProcess) {
  const std::pair<const char*, std::function<void()>> kAll[] = {
      {"folder removed", [&] { std::filesystem::remove_all(state_); }},
      {"cut to 0", [&] { std::filesystem::resize_file(file(), 0); }},
      {"replaced",
       [&] {
         std::filesystem::copy_file(file(), folder_ / "copy");
         std::filesystem::rename(folder_ / "copy", file());
       }},
  };
  for (const auto& [what, mutilate] : kAll) {
    {
      RunningProcess slave("slave_io", options(), folder_);
      ASSERT_TRUE(eventually([&] { return slave_is(msg::LinkState::LINK_INIT); })) << slave.log();
      mutilate();
      kill(slave.pid(), SIGUSR1);
      ASSERT_TRUE(eventually([&] { return slave_is(msg::LinkState::LINK_STOPPED); })) << what << slave.log();
      EXPECT_TRUE(eventually([&] { return slave.log().find("while in use") != std::string::npos; }))
          << what << slave.log();
      ASSERT_TRUE(slave.running()) << what << slave.log();
      slave.end(SIGKILL);
    }
    RunningProcess next("slave_io", options(), folder_);
    EXPECT_TRUE(is_stopped_from_its_start()) << what << next.log();
    next.end(SIGTERM);
    std::filesystem::remove_all(state_);
    const std::lock_guard lock(mutex_);
    slave_.reset();
  }
}

// Tries slave_io: its terminal is closed
TEST_F(StopKept, AHangUpAndAQuitEndItInOrderWhileAJointMoves) {
  for (const int number : {SIGHUP, SIGQUIT}) {
    RunningProcess slave("slave_io", options(), folder_);
    RunningProcess master("master_io", options("master"), folder_);
    ASSERT_TRUE(eventually([&] { return speed_rad_s() > 0.1; })) << slave.log();
    slave.end(number);
    EXPECT_EQ(slave.exit_code(), 0) << slave.log();
    master.end(number);
    EXPECT_EQ(master.exit_code(), 0) << master.log();
    const std::lock_guard lock(mutex_);
    slave_.reset();
  }
}

// Whether the process handles the signal by now.
bool handles(pid_t pid, int number) {
  const std::string status = test::read_text("/proc/" + std::to_string(pid) + "/status");
  const auto at = status.find("SigCgt:");
  return at != std::string::npos &&
         (std::stoull(status.substr(at + 7), nullptr, 16) >> (number - 1) & 1U) != 0;
}

TEST_F(StopKept, AnEmergencyStopInTheFirstMillisecondsIsKept) {
  for (const int delay_ms : {0, 8, 18, 48}) {
    RunningProcess slave("slave_io", options("early"), folder_);
    // The loader itself has to be done, however long it takes: it runs before any code of the executable.
    ASSERT_TRUE(eventually([&] { return !slave.running() || handles(slave.pid(), SIGUSR1); }));
    usleep(static_cast<useconds_t>(1'000 * delay_ms));
    kill(slave.pid(), SIGUSR1);
    EXPECT_TRUE(is_stopped_from_its_start()) << delay_ms << " ms: exit " << slave.exit_code() << slave.log();
    slave.end(SIGTERM);
    std::filesystem::remove_all(folder_ / "early");
  }
}

}  // namespace
}  // namespace phantom::processes

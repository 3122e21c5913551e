// A thread of a running process is really stopped, by the kernel, and nothing else is: what the process then
// says of itself must come from the thread's own progress. The quick form has three threads, the long one
// (thorough.hpp) all that have a loop.
#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <mutex>
#include <optional>
#include <regex>
#include <thread>

#include "common/core/progress.hpp"
#include "common/dds/endpoints/endpoint.hpp"
#include "tests/processes/running_process.hpp"
#include "tests/support/eventually.hpp"
#include "tests/support/files.hpp"
#include "tests/support/frozen_thread.hpp"
#include "tests/support/own_domain.hpp"
#include "tests/support/thorough.hpp"

namespace phantom::processes {
namespace {

using phantom::test::eventually;

struct Case {
  const char* component;
  const char* thread;
  const char* loop;  // as component_status calls it
};

/// A browser that draws the scene by itself: follows the viewer's scene stream, and throws away what comes.
class SceneFollower {
 public:
  explicit SceneFollower(int port) : socket_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in viewer{};
    viewer.sin_family = AF_INET;
    viewer.sin_port = htons(static_cast<std::uint16_t>(port));
    inet_pton(AF_INET, "127.0.0.1", &viewer.sin_addr);
    const std::string request =
        "GET /scene HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(port) +
        "\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
        "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n";
    const std::string draws("\x81\x8F\0\0\0\0{\"rate_Hz\": 60}", 21);  // a frame, masked with zeros
    char answer[4096];
    if (connect(socket_, reinterpret_cast<sockaddr*>(&viewer), sizeof viewer) != 0 ||
        send(socket_, request.data(), request.size(), MSG_NOSIGNAL) != static_cast<ssize_t>(request.size()) ||
        recv(socket_, answer, sizeof answer, 0) <= 0 ||
        send(socket_, draws.data(), draws.size(), MSG_NOSIGNAL) != static_cast<ssize_t>(draws.size()))
      throw std::runtime_error("the scene stream is not there");
    reader_ = std::thread([this] {
      for (char part[4096]; recv(socket_, part, sizeof part, 0) > 0;)
        ;
    });
  }
  ~SceneFollower() {
    shutdown(socket_, SHUT_RDWR);
    reader_.join();
    close(socket_);
  }
  SceneFollower(const SceneFollower&) = delete;
  SceneFollower& operator=(const SceneFollower&) = delete;

 private:
  int socket_;
  std::thread reader_;
};

class HungThread : public testing::TestWithParam<Case> {
 protected:
  HungThread()
      : folder_(test::new_folder()),
        network_{.domain = test::own_domain(),
                 .qos_profiles = PHANTOM_SOURCE_DIR "/deploy/qos/phantom.xml",
                 .interfaces = {"127.0.0.1"}},
        participant_("hung_thread_test", network_),
        statuses_(participant_, dds::kComponentStatus,
                  [this](const msg::ComponentStatus& status, const dds::SampleInfo&) {
                    const std::lock_guard lock(mutex_);
                    status_ = status;
                    ++statuses_seen_;
                  }),
        process_(GetParam().component,
                 {.arguments = arguments(), .environment = {{"NOTIFY_SOCKET", notify_.name()}}}, folder_) {}

  std::vector<std::string> arguments() const {
    std::vector<std::string> all{"--deployment", write_topology(folder_).string(), "--domain",
                                 std::to_string(network_.domain)};
    if (GetParam().component == std::string("synthetic_viewer"))
      all.insert(all.end(), {"--config", (folder_ / "synthetic_viewer.yaml").string()});
    return all;
  }

  msg::ComponentStatus status() {
    const std::lock_guard lock(mutex_);
    return status_.value_or(msg::ComponentStatus());
  }
  int statuses_seen() {
    const std::lock_guard lock(mutex_);
    return statuses_seen_;
  }
  std::optional<msg::LoopStatistics> loop() {
    const msg::ComponentStatus now = status();
    for (const auto& loop : now.loops()) {
      if (loop.name() == GetParam().loop) return loop;
    }
    return std::nullopt;
  }
  // The viewer's thread `scene` rests until somebody follows it.
  void follow_scene() {
    std::smatch port;
    ASSERT_TRUE(eventually([&] {
      const std::string log = process_.log();
      const bool found = std::regex_search(log, port, std::regex("live pictures and events: port (\\d+)"));
      if (found) follower_.emplace(std::stoi(port[1]));
      return found;
    })) << process_.log();
  }
  // All that the service manager hears until the status has come `count` times more.
  std::vector<std::string> heard_while(int count) {
    notify_.take();
    const int until = statuses_seen() + count;
    EXPECT_TRUE(eventually([&] { return statuses_seen() >= until; }));
    return notify_.take();
  }

  std::filesystem::path folder_;
  core::NetworkOptions network_;
  std::mutex mutex_;
  std::optional<msg::ComponentStatus> status_;
  int statuses_seen_ = 0;
  NotifySocket notify_;
  dds::Participant participant_;
  dds::Reader<msg::ComponentStatus> statuses_;
  RunningProcess process_;
  std::optional<SceneFollower> follower_;
};

const int kStatuses = test::thorough_or(2, 3);  // of 2 Hz, for which the service manager is listened to

// Tries synthetic_viewer: the page's reading thread hangs for 3 s; the scene's thread
// Tries master_io: the servo does not run for a second; the publisher
TEST_P(HungThread, IsSeenInTheStatusAndStarvesTheServiceManagersWatchdogUntilItRunsAgain) {
  using testing::Each;
  using testing::HasSubstr;
  using testing::Not;
  if (GetParam().loop == std::string("scene")) {
    ASSERT_NO_FATAL_FAILURE(follow_scene());
  }
  ASSERT_TRUE(eventually([&] {
    return loop() && loop()->ticks() > 20 && status().state() != msg::ComponentState::COMPONENT_FAULT;
  })) << process_.log();
  const auto healthy = heard_while(kStatuses);
  ASSERT_FALSE(healthy.empty());
  EXPECT_THAT(healthy, Each(HasSubstr("WATCHDOG=1")));
  const std::string sentence = std::string("the ") + GetParam().loop + " loop has not run for ";
  {
    const pid_t thread = process_.thread(GetParam().thread);
    ASSERT_NE(thread, 0) << GetParam().thread;
    const test::FrozenThread frozen(thread);
    ASSERT_TRUE(eventually([&] { return status().state() == msg::ComponentState::COMPONENT_FAULT; }))
        << status().message();
    EXPECT_THAT(status().message().to_string(), HasSubstr(sentence));
    ASSERT_TRUE(eventually([&] { return loop()->idle_s() > test::thorough_or(1.5, 3.0); }));
    EXPECT_EQ(loop()->rate_hz(), 0.0) << "none of its ticks is of the last second";
    EXPECT_EQ(status().state(), msg::ComponentState::COMPONENT_FAULT);
    const auto hung = heard_while(kStatuses);
    ASSERT_FALSE(hung.empty()) << "it still says what is wrong";
    EXPECT_THAT(hung, Each(Not(HasSubstr("WATCHDOG=1"))));
    EXPECT_THAT(hung, Each(HasSubstr(sentence)));
  }
  EXPECT_TRUE(eventually([&] {
    return status().state() != msg::ComponentState::COMPONENT_FAULT && loop()->rate_hz() > 0.0;
  })) << "it was only held up: "
      << status().message();
  EXPECT_THAT(heard_while(kStatuses), Each(HasSubstr("WATCHDOG=1")));
}

// A real-time loop, one that waits for events, and one that rests until somebody wants it.
const std::vector<Case> kQuickCases{{"slave_io", "servo", "servo"},
                                    {"phantom_sensing", "alerts", "alerts"},
                                    {"synthetic_viewer", "scene", "scene"}};
const std::vector<Case> kFurtherCases{
    {"slave_io", "publisher", "publisher"},  {"master_io", "servo", "servo"},
    {"master_io", "publisher", "publisher"}, {"phantom_sensing", "sensing", "sensing"},
    {"audio_percept", "audio", "audio"},     {"synthetic_viewer", "page_reader", "page"}};

std::vector<Case> cases() {
  std::vector<Case> all = kQuickCases;
  if (test::thorough()) all.insert(all.end(), kFurtherCases.begin(), kFurtherCases.end());
  return all;
}

INSTANTIATE_TEST_SUITE_P(Threads, HungThread, testing::ValuesIn(cases()), [](const auto& tested) {
  return std::string(tested.param.component) + "_" + tested.param.thread;
});

// Held up while it computes, so that the start takes as long as on a very slow host.
TEST(SlowStart, OfSlaveIoIsToldTheServiceManagerAllTheWhile) {
  using testing::Each;
  using testing::HasSubstr;
  const auto folder = test::new_folder();
  NotifySocket notify;
  RunningProcess slave(
      "slave_io",
      {.arguments = {"--deployment", write_topology(folder).string(), "--domain",
                     std::to_string(test::own_domain())},
       .environment = {{"NOTIFY_SOCKET", notify.name()}, {"PHANTOM_STATE_DIR", (folder / "state").string()}}},
      folder);
  pid_t computing = 0;
  ASSERT_TRUE(eventually([&] { return (computing = slave.thread("helper")) != 0; })) << slave.log();
  std::vector<std::string> heard;
  const auto listen = [&] {
    const auto more = notify.take();
    heard.insert(heard.end(), more.begin(), more.end());
    return heard.size();
  };
  {
    const test::FrozenThread frozen(computing);
    notify.take();
    ASSERT_TRUE(eventually([&] { return listen() >= 6; })) << "of 2 Hz\n" << slave.log();
    EXPECT_THAT(heard, Each(HasSubstr("WATCHDOG=1")));
    EXPECT_THAT(heard, Each(HasSubstr("placing the bodies")));
  }
  EXPECT_TRUE(eventually([&] {
    listen();
    return heard.back().find("placing the bodies") == std::string::npos;
  })) << heard.back();
}

}  // namespace
}  // namespace phantom::processes

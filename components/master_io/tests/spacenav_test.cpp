// spacenavd as libspnav knows it: a server of its socket with its protocol, which the test makes.
#include "components/master_io/devices/spacenav.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <mutex>
#include <thread>

#include "common/core/errors.hpp"
#include "components/master_io/devices/desk_input.hpp"
#include "tests/support/eventually.hpp"

namespace phantom::master_io {
namespace {

using test::eventually;
using testing::HasSubstr;

constexpr std::int32_t kMotion = 0, kPress = 1, kRelease = 2;

/// Serves the daemon's socket to one client: answers the request for a protocol, then sends events of eight
/// numbers each.
class Daemon {
 public:
  explicit Daemon(const std::filesystem::path& path) : path_(path) {
    std::filesystem::remove(path_);
    listener_ = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path_.string().copy(address.sun_path, sizeof address.sun_path - 1);
    EXPECT_EQ(bind(listener_, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    EXPECT_EQ(listen(listener_, 1), 0);
    thread_ = std::thread([this] {
      const int client = accept(listener_, nullptr, nullptr);
      std::int32_t request = 0;
      if (client < 0 || ::read(client, &request, sizeof request) != sizeof request) return;
      asked_ = request;
      EXPECT_EQ(write(client, &request, sizeof request), static_cast<ssize_t>(sizeof request));
      client_ = client;
    });
  }
  ~Daemon() { end(); }
  void end() {
    if (listener_ < 0) return;
    shutdown(listener_, SHUT_RDWR);
    thread_.join();
    if (client_ >= 0) close(client_);
    close(listener_);
    listener_ = -1;
    std::filesystem::remove(path_);
  }
  bool connected() {
    return eventually([&] { return client_ >= 0; });
  }
  std::int32_t asked() const { return asked_; }
  void send(const std::array<std::int32_t, 8>& event) {
    EXPECT_EQ(::send(client_, event.data(), sizeof event, MSG_NOSIGNAL), static_cast<ssize_t>(sizeof event));
  }

 private:
  std::filesystem::path path_;
  int listener_ = -1;
  std::atomic<int> client_{-1};
  std::atomic<std::int32_t> asked_{0};
  std::thread thread_;
};

class SpacenavInput : public testing::Test {
 protected:
  SpacenavInput() {
    if (!Spacenav::built_in()) return;
    path_ = std::filesystem::temp_directory_path() / ("phantom_spnav_" + std::to_string(getpid()));
    setenv("SPNAV_SOCKET", path_.c_str(), 1);
    config_.space_mouse = true;
    config_.device = "spacenavd";
  }
  void SetUp() override {
    if (!Spacenav::built_in()) GTEST_SKIP() << "this build lacks libspnav (scripts/setup installs it)";
  }
  ~SpacenavInput() override { unsetenv("SPNAV_SOCKET"); }

  void open() {
    input_ = std::make_unique<ManualInput>(config_, state_,
                                           ManualInput::Listener{[this] { ++stops_; }, [] {},
                                                                 [this](const std::string& words) {
                                                                   const std::lock_guard lock(mutex_);
                                                                   notices_ += words + "\n";
                                                                 }},
                                           0);
  }
  template <class Condition>
  bool shows(Condition condition) {
    return eventually([&] {
      state_.read(now_);
      return condition(now_);
    });
  }
  bool noticed(const std::string& words) {
    return eventually([&] {
      const std::lock_guard lock(mutex_);
      return notices_.find(words) != std::string::npos;
    });
  }

  std::filesystem::path path_;
  DeskConfig config_;
  core::Snapshot<DeskState> state_;
  DeskState now_;
  std::atomic<int> stops_{0};
  std::mutex mutex_;
  std::string notices_;
  std::unique_ptr<ManualInput> input_;
};

TEST_F(SpacenavInput, WhatTheDaemonReportsMovesAndItsButtonsAreClutchAndStop) {
  Daemon daemon(path_);
  open();
  ASSERT_TRUE(daemon.connected());
  EXPECT_NE(daemon.asked(), 0) << "libspnav asks for its protocol";
  EXPECT_EQ(input_->name(), "spacenavd");
  daemon.send({kMotion, 350, -175, 700, 35, 70, -105, 8});
  ASSERT_TRUE(shows([](const DeskState& s) { return s.alive && s.axes[0] != 0.0; }));
  const std::array<double, 6> expected{1.0, 1.0, -0.5, 0.1, -0.3, 0.2};  // right, away, up; about these
  for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(now_.axes[i], expected[i], 1e-12) << i;
  daemon.send({kPress, 0});
  EXPECT_TRUE(shows([](const DeskState& s) { return s.clutch_out; }));
  daemon.send({kRelease, 0});
  EXPECT_TRUE(shows([](const DeskState& s) { return !s.clutch_out; }));
  daemon.send({kPress, 1});
  EXPECT_TRUE(eventually([&] { return stops_ == 1; }));
  daemon.send({99, 1, 2, 3, 4, 5, 6, 7});
  daemon.send({kMotion, 0, 35, 0, 0, 0, 0, 8});
  EXPECT_TRUE(shows([](const DeskState& s) { return s.axes[2] == 0.1 && s.axes[0] == 0.0; }))
      << "what is unknown is passed over";
}

TEST_F(SpacenavInput, ADaemonThatHangsHoldsNoDeflection) {
  Daemon daemon(path_);
  open();
  ASSERT_TRUE(daemon.connected());
  daemon.send({kMotion, 350, 0, 0, 0, 0, 0, 8});
  ASSERT_TRUE(shows([](const DeskState& s) { return s.axes[0] == 1.0; }));
  EXPECT_TRUE(shows([](const DeskState& s) { return s.alive && s.axes[0] == 0.0; }));
}

TEST_F(SpacenavInput, ADaemonThatEndsPushesNothingUntilItIsBack) {
  auto daemon = std::make_unique<Daemon>(path_);
  open();
  ASSERT_TRUE(daemon->connected());
  daemon->send({kMotion, 350, 0, 0, 0, 0, 0, 8});
  daemon->send({kPress, 0});
  ASSERT_TRUE(shows([](const DeskState& s) { return s.clutch_out; }));
  daemon.reset();
  EXPECT_TRUE(shows([](const DeskState& s) { return !s.alive && s.axes[0] == 0.0; }));
  EXPECT_TRUE(noticed("spacenavd is gone"));
  daemon = std::make_unique<Daemon>(path_);
  EXPECT_TRUE(shows([](const DeskState& s) { return s.alive && s.axes[0] == 0.0 && !s.clutch_out; }));
  EXPECT_TRUE(noticed("spacenavd is back"));
  daemon->send({kMotion, 0, 0, 350, 0, 0, 0, 8});
  EXPECT_TRUE(shows([](const DeskState& s) { return s.axes[1] == 1.0; }));
}

TEST_F(SpacenavInput, WithoutADaemonTheStartSaysWhatIsMissing) {
  try {
    check_device(config_);
    ADD_FAILURE() << "accepted";
  } catch (const core::MissingError& error) {
    EXPECT_THAT(error.what(), HasSubstr("desk.device: spacenavd: no process serves its socket"));
  }
  Daemon daemon(path_);
  EXPECT_NO_THROW(check_device(config_));
}

TEST_F(SpacenavInput, AutoPrefersTheDaemonWhichKeepsTheMouseToItself) {
  Daemon daemon(path_);
  config_.device = "auto";
  open();
  EXPECT_EQ(input_->name(), "spacenavd");
}

}  // namespace
}  // namespace phantom::master_io

// What no emulated controller does: bus errors, error states and bus-off, on the kernel's serial-line driver
// (slcan). The test is the adapter at the other end of the line. Needs root and the modules;
// scripts/test_can_vm has both.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <linux/can.h>
#include <net/if.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <termios.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>
#include <mutex>
#include <thread>

#include "common/can/socket_can.hpp"

namespace phantom::can {
namespace {

constexpr core::Nanoseconds kPatience_ns = 2 * core::kNsPerSecond;

/// A serial CAN adapter: the far end of a pseudo terminal with the slcan line discipline.
class Adapter {
 public:
  Adapter() : far_(open("/dev/ptmx", O_RDWR | O_NOCTTY | O_CLOEXEC)) {
    if (far_ < 0 || grantpt(far_) != 0 || unlockpt(far_) != 0) return;
    near_ = open(ptsname(far_), O_RDWR | O_NOCTTY | O_CLOEXEC);
    termios raw{};
    tcgetattr(near_, &raw);
    cfmakeraw(&raw);
    tcsetattr(near_, TCSANOW, &raw);
    int discipline = 17;  // N_SLCAN
    char name[IFNAMSIZ + 1] = {};
    if (ioctl(near_, TIOCSETD, &discipline) != 0 || ioctl(near_, SIOCGIFNAME, name) != 0) return;
    interface = name;
    reader_ = std::jthread([this](const std::stop_token& stop) { drain(stop); });
    set_up();
  }
  ~Adapter() { unplug(); }

  /// As if its cable were pulled out.
  void unplug() {
    if (reader_.joinable()) {
      reader_.request_stop();
      reader_.join();
    }
    if (near_ >= 0) close(near_);
    if (far_ >= 0) close(far_);
    near_ = far_ = -1;
  }
  /// What the adapter reports to the host: a frame, or an error, as one line of its protocol.
  void says(const std::string& line) {
    const std::string text = line + '\r';
    ASSERT_EQ(write(far_, text.data(), text.size()), static_cast<ssize_t>(text.size()));
  }
  bool was_sent(const std::string& line) {
    for (int i = 0; i < 2000; ++i) {
      {
        const std::lock_guard lock(mutex_);
        if (received_.find(line + '\r') != std::string::npos) return true;
      }
      usleep(1000);
    }
    return false;
  }

  std::string interface;  ///< empty: this kernel or user cannot

 private:
  // The line must be drained, or the driver stops sending.
  void drain(const std::stop_token& stop) {
    fcntl(far_, F_SETFL, O_NONBLOCK);
    while (!stop.stop_requested()) {
      char bytes[256];
      const ssize_t size = read(far_, bytes, sizeof bytes);
      if (size <= 0) {
        usleep(500);
        continue;
      }
      const std::lock_guard lock(mutex_);
      received_.append(bytes, static_cast<std::size_t>(size));
    }
  }
  void set_up() {
    const int any = socket(PF_CAN, SOCK_RAW, CAN_RAW);
    ifreq request{};
    std::strncpy(request.ifr_name, interface.c_str(), IFNAMSIZ - 1);
    ioctl(any, SIOCGIFFLAGS, &request);
    request.ifr_flags = static_cast<short>(request.ifr_flags | IFF_UP);
    if (ioctl(any, SIOCSIFFLAGS, &request) != 0) interface.clear();
    close(any);
  }

  int far_ = -1, near_ = -1;
  std::mutex mutex_;
  std::string received_;
  std::jthread reader_;
};

class SlCan : public testing::Test {
 protected:
  void SetUp() override {
    if (std::getenv("PHANTOM_CAN_SLCAN") == nullptr)
      GTEST_SKIP() << "needs slcan and root; scripts/test_can_vm runs these cases on Debian's own kernel";
    adapter_ = std::make_unique<Adapter>();
    ASSERT_FALSE(adapter_->interface.empty()) << std::strerror(errno);
    auto bus = open_socket_can(adapter_->interface);
    ASSERT_TRUE(bus) << bus.status().message();
    bus_ = std::move(bus).value();
  }
  // The next thing that comes.
  Received next() {
    Received received;
    if (!bus_->wait(kPatience_ns) || !bus_->receive(received)) ADD_FAILURE() << "nothing came";
    return received;
  }
  // The errors of everything that comes until the wanted one.
  std::uint16_t errors_until(std::uint16_t wanted) {
    std::uint16_t errors = 0;
    for (Received r; (errors & wanted) == 0 && bus_->wait(kPatience_ns) && bus_->receive(r);)
      errors = static_cast<std::uint16_t>(errors | r.errors);
    return errors;
  }
  std::unique_ptr<Adapter> adapter_;
  std::unique_ptr<CanBus> bus_;
};

TEST_F(SlCan, FramesGoBothWays) {
  adapter_->says("t1232AABB");
  const Received received = next();
  ASSERT_TRUE(received.is_frame());
  EXPECT_EQ(received.frame, (CanFrame{.id = 0x123, .length = 2, .data = {0xAA, 0xBB}}));
  EXPECT_EQ(bus_->send({.id = 0x321, .length = 1, .data = {0x5C}}), SendResult::kSent);
  EXPECT_TRUE(adapter_->was_sent("t32115C"));
}

TEST_F(SlCan, BusErrorsAreToldByTheirKind) {
  const std::pair<const char*, std::uint16_t> cases[] = {{"e1a", kErrorNoAck},    {"e1f", kErrorProtocol},
                                                         {"e1s", kErrorProtocol}, {"e1b", kErrorProtocol},
                                                         {"e1c", kErrorProtocol}, {"e1o", kErrorOverflow}};
  for (const auto& [line, wanted] : cases) {
    adapter_->says(line);
    EXPECT_TRUE(errors_until(wanted) & wanted) << line;
    EXPECT_EQ(bus_->state(), BusState::kActive) << line << ": one error is not yet a state";
  }
}

TEST_F(SlCan, TheControllersStatesAreFollowed) {
  const std::pair<const char*, BusState> cases[] = {{"sw000100", BusState::kWarning},
                                                    {"sp000130", BusState::kPassive},
                                                    {"sw000110", BusState::kWarning},
                                                    {"sa000000", BusState::kActive},
                                                    {"sp130000", BusState::kPassive}};
  for (const auto& [line, wanted] : cases) {
    adapter_->says(line);
    EXPECT_TRUE(errors_until(kErrorState) & kErrorState) << line;
    EXPECT_EQ(bus_->state(), wanted) << line;
    EXPECT_EQ(bus_->send({.id = 1}), SendResult::kSent) << "a bus in trouble is still a bus";
  }
}

TEST_F(SlCan, BusOffTakesNoFrameAndIsLeftByARestart) {
  adapter_->says("sb000256");
  EXPECT_TRUE(errors_until(kErrorBusOff) & kErrorBusOff);
  EXPECT_EQ(bus_->state(), BusState::kBusOff);
  EXPECT_EQ(bus_->counters().bus_offs, 1U);
  EXPECT_EQ(bus_->send({.id = 1}), SendResult::kBusOff);
  ASSERT_TRUE(bus_->restart().is_ok());
  EXPECT_EQ(bus_->state(), BusState::kActive);
  EXPECT_EQ(bus_->send({.id = 0x77, .length = 1, .data = {1}}), SendResult::kSent);
  EXPECT_TRUE(adapter_->was_sent("t077101"));
  adapter_->says("t0550");
  for (Received r = next();; r = next()) {
    if (HasFailure()) break;
    if (r.is_frame()) {
      EXPECT_EQ(r.frame.id, 0x55U);
      break;
    }
  }
}

TEST_F(SlCan, AnAdapterThatIsPulledOutIsABusThatIsDown) {
  adapter_->unplug();
  EXPECT_TRUE(errors_until(kErrorDown) & kErrorDown);
  EXPECT_EQ(bus_->state(), BusState::kDown);
  EXPECT_EQ(bus_->send({.id = 1}), SendResult::kDown);
  EXPECT_NE(bus_->restart().message().find("is gone"), std::string::npos);
}

}  // namespace
}  // namespace phantom::can

// A gamepad that the kernel believes in: made by this test through /dev/uinput, found, read and made to
// rumble through /dev/input as any other. Needs root and the modules; scripts/test_can_vm has both.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <linux/uinput.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstring>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>

#include "common/runtime/servo/switch_input.hpp"
#include "components/master_io/devices/desk_input.hpp"
#include "tests/support/eventually.hpp"

namespace phantom::master_io {
namespace {

using phantom::test::eventually;

class Gamepad {
 public:
  Gamepad() : fd_(open("/dev/uinput", O_RDWR | O_NONBLOCK | O_CLOEXEC)) {
    for (const int kind : {EV_ABS, EV_KEY, EV_FF}) ioctl(fd_, UI_SET_EVBIT, kind);
    for (const int key : {BTN_SOUTH, BTN_TL, BTN_TR, BTN_SELECT, BTN_START}) ioctl(fd_, UI_SET_KEYBIT, key);
    ioctl(fd_, UI_SET_FFBIT, FF_RUMBLE);
    for (const int axis : {ABS_X, ABS_Y, ABS_RX, ABS_RY}) {
      uinput_abs_setup setup{};
      setup.code = static_cast<__u16>(axis);
      setup.absinfo.minimum = -1000;
      setup.absinfo.maximum = 1000;
      ioctl(fd_, UI_ABS_SETUP, &setup);
    }
    uinput_setup setup{};
    std::strcpy(setup.name, "Test gamepad");
    setup.id.bustype = BUS_USB;
    setup.ff_effects_max = 4;
    made_ = ioctl(fd_, UI_DEV_SETUP, &setup) == 0 && ioctl(fd_, UI_DEV_CREATE) == 0;
    motor_ = std::jthread([this](const std::stop_token& stop) { run_motor(stop); });
  }
  ~Gamepad() { unplug(); }
  bool made() const { return made_; }
  void unplug() {
    motor_.request_stop();
    if (motor_.joinable()) motor_.join();
    if (fd_ >= 0) close(fd_);
    fd_ = -1;
  }
  void send(std::uint16_t type, std::uint16_t code, int value) {
    for (const auto& [t, c, v] : {std::tuple{type, code, value},
                                  std::tuple<std::uint16_t, std::uint16_t, int>{EV_SYN, SYN_REPORT, 0}}) {
      input_event e{};
      e.type = t, e.code = c, e.value = v;
      ASSERT_EQ(write(fd_, &e, sizeof e), static_cast<ssize_t>(sizeof e));
    }
  }
  /// Strength 0…1 of the effect that was played last.
  double felt() const { return felt_; }

 private:
  // The kernel asks the device to take an effect before it is played.
  void run_motor(const std::stop_token& stop) {
    double taken = 0.0;
    while (!stop.stop_requested()) {
      input_event e{};
      if (read(fd_, &e, sizeof e) != static_cast<ssize_t>(sizeof e)) {
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
        continue;
      }
      if (e.type == EV_UINPUT && e.code == UI_FF_UPLOAD) {
        uinput_ff_upload upload{};
        upload.request_id = static_cast<__u32>(e.value);
        ioctl(fd_, UI_BEGIN_FF_UPLOAD, &upload);
        taken = upload.effect.u.rumble.strong_magnitude / 65535.0;
        upload.retval = 0;
        ioctl(fd_, UI_END_FF_UPLOAD, &upload);
      } else if (e.type == EV_UINPUT && e.code == UI_FF_ERASE) {
        uinput_ff_erase erase{};
        erase.request_id = static_cast<__u32>(e.value);
        ioctl(fd_, UI_BEGIN_FF_ERASE, &erase);
        ioctl(fd_, UI_END_FF_ERASE, &erase);
      } else if (e.type == EV_FF && e.value != 0) {
        felt_ = taken;
      }
    }
  }
  int fd_;
  bool made_ = false;
  std::atomic<double> felt_{-1.0};
  std::jthread motor_;
};

DeskConfig first_joints() {
  DeskConfig config;
  config.banks = {{0, 1, 2, 3}};
  config.push.fill(2.0);
  config.brake.fill(4.0);
  return config;
}

TEST(Uinput, AGamepadIsFoundReadAndRumblesUntilItIsPulledOut) {
  if (std::getenv("PHANTOM_UINPUT") == nullptr)
    GTEST_SKIP() << "needs /dev/uinput and root; scripts/test_can_vm runs this case on Debian's own kernel";
  Gamepad gamepad;
  ASSERT_TRUE(gamepad.made()) << std::strerror(errno);
  core::Snapshot<DeskState> state;
  std::atomic<int> stops{0}, resets{0};
  std::mutex mutex;
  std::string reported;
  ManualInput input(first_joints(), state,
                    {[&] { ++stops; }, [&] { ++resets; },
                     [&](const std::string& what) {
                       const std::lock_guard lock(mutex);
                       reported += what + '\n';
                     }},
                    0);
  EXPECT_EQ(input.name().rfind("Test gamepad (/dev/input/event", 0), 0U) << input.name();
  DeskState now;
  const auto axis_is = [&](std::size_t axis, double value) {
    return eventually([&] {
      state.read(now);
      return now.alive && std::abs(now.axes[axis] - value) < 1e-9;
    });
  };
  EXPECT_TRUE(eventually([&] {
    const std::lock_guard lock(mutex);
    return reported.find("felt as rumble") != std::string::npos;
  }));
  gamepad.send(EV_ABS, ABS_Y, -1000);
  EXPECT_TRUE(axis_is(1, 1.0)) << "up is positive";
  gamepad.send(EV_ABS, ABS_RX, 1000);
  EXPECT_TRUE(axis_is(2, 1.0));
  input.rumble(0.5);
  EXPECT_TRUE(eventually([&] { return std::abs(gamepad.felt() - 0.5) < 1e-3; }));
  input.rumble(0.0);
  EXPECT_TRUE(eventually([&] { return gamepad.felt() == 0.0; }));
  gamepad.send(EV_KEY, BTN_SELECT, 1);
  EXPECT_TRUE(eventually([&] { return stops == 1; }));
  gamepad.send(EV_KEY, BTN_START, 1);
  EXPECT_TRUE(eventually([&] { return resets == 1; }));
  gamepad.unplug();
  EXPECT_TRUE(eventually([&] {
    state.read(now);
    return !now.alive;
  })) << "nothing is pushed any more";
  const std::lock_guard lock(mutex);
  EXPECT_NE(reported.find("device removed"), std::string::npos);
}

TEST(Uinput, AButtonOfAGamepadIsAnEnablingSwitchUntilItIsPulledOut) {
  if (std::getenv("PHANTOM_UINPUT") == nullptr)
    GTEST_SKIP() << "needs /dev/uinput and root; scripts/test_can_vm runs this case on Debian's own kernel";
  Gamepad gamepad;
  ASSERT_TRUE(gamepad.made()) << std::strerror(errno);
  const runtime::SwitchKeys keys{.device = "Test gamepad", .key = BTN_SOUTH};
  std::unique_ptr<runtime::SwitchDevice> device;
  ASSERT_TRUE(eventually([&] {  // its file comes a moment after the device
    device = std::make_unique<runtime::SwitchDevice>(keys);
    return device->plugged_in();
  })) << device->name();
  EXPECT_FALSE(device->wait(0).contacts.first);
  const auto is = [&](bool held) {
    return eventually([&] { return device->wait(1).contacts.first == held; });
  };
  gamepad.send(EV_KEY, BTN_SOUTH, 1);
  EXPECT_TRUE(is(true));
  gamepad.send(EV_KEY, BTN_SOUTH, 0);
  EXPECT_TRUE(is(false));
  // More events than the kernel keeps for a reader: what was held before is read from the device.
  gamepad.send(EV_KEY, BTN_SOUTH, 1);
  for (int i = 0; i < 5000; ++i) gamepad.send(EV_KEY, BTN_TL, (i + 1) % 2);
  EXPECT_TRUE(is(true));
  EXPECT_TRUE(runtime::SwitchDevice(keys).wait(0).contacts.first) << "one that opens it while it is held";
  gamepad.unplug();
  EXPECT_TRUE(eventually([&] { return !device->wait(1).contacts.read; }));
  EXPECT_FALSE(device->plugged_in());
}

}  // namespace
}  // namespace phantom::master_io

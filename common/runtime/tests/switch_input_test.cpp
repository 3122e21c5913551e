// The keys of an enabling switch: the kernel's events decoded, and a device that a pipe stands for.
#include "common/runtime/servo/switch_input.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <map>
#include <random>

#include "tests/support/eventually.hpp"

namespace phantom::runtime {
namespace {

constexpr SwitchKeys kNoKeys{};
SwitchKeys keys() {
  SwitchKeys made = kNoKeys;
  made.key = BTN_THUMBR;
  made.through_key = BTN_TR2;
  return made;
}

input_event event(int type, int code, int value) {
  input_event e{};
  e.type = static_cast<__u16>(type), e.code = static_cast<__u16>(code), e.value = value;
  return e;
}

TEST(SwitchDecoder, SR19_TakesDownAndUpOfItsKeysAndIgnoresRepetitionAndOtherKeys) {
  SwitchDecoder decoder(keys());
  EXPECT_FALSE(decoder.reading().contacts.read) << "before its state was read";
  decoder.set(false, false);
  EXPECT_TRUE(decoder.reading().contacts.read);
  EXPECT_FALSE(decoder.take(event(EV_KEY, BTN_THUMBR, 1)));
  EXPECT_TRUE(decoder.reading().contacts.first && decoder.reading().contacts.second);
  decoder.take(event(EV_KEY, BTN_THUMBR, 2));
  decoder.take(event(EV_KEY, BTN_THUMBL, 0));
  decoder.take(event(EV_ABS, BTN_THUMBR, 0));
  EXPECT_TRUE(decoder.reading().contacts.first);
  decoder.take(event(EV_KEY, BTN_TR2, 1));
  EXPECT_TRUE(decoder.reading().contacts.through);
  decoder.take(event(EV_KEY, BTN_TR2, 0));
  EXPECT_FALSE(decoder.reading().contacts.through);
  EXPECT_EQ(decoder.reading().let_go, 0U);
  decoder.take(event(EV_KEY, BTN_THUMBR, 0));
  EXPECT_FALSE(decoder.reading().contacts.first || decoder.reading().contacts.second);
  EXPECT_EQ(decoder.reading().let_go, 1U);
  decoder.take(event(EV_KEY, BTN_THUMBR, 2));
  EXPECT_FALSE(decoder.reading().contacts.first) << "repetition presses nothing";
}

TEST(SwitchDecoder, SR19_AfterLostEventsNothingUpToTheNextReportCountsAndTheStateIsReadAnew) {
  SwitchDecoder decoder(keys());
  decoder.set(true, false);
  EXPECT_FALSE(decoder.take(event(EV_SYN, SYN_REPORT, 0)));
  EXPECT_FALSE(decoder.take(event(EV_SYN, SYN_DROPPED, 0)));
  EXPECT_FALSE(decoder.take(event(EV_KEY, BTN_THUMBR, 0)));
  EXPECT_TRUE(decoder.reading().contacts.first);
  EXPECT_TRUE(decoder.take(event(EV_SYN, SYN_REPORT, 0))) << "read it anew";
  decoder.set(false, false);
  EXPECT_FALSE(decoder.reading().contacts.first);
  EXPECT_EQ(decoder.reading().let_go, 1U);
  EXPECT_FALSE(decoder.take(event(EV_KEY, BTN_THUMBR, 1)));
  EXPECT_TRUE(decoder.reading().contacts.first);
}

TEST(SwitchDecoder, AnyEventsLeaveTheStateOfTheNewestOfEachKey) {
  std::mt19937 random(5);
  SwitchDecoder decoder(keys());
  decoder.set(false, false);
  bool down = false, through = false;
  for (int i = 0; i < 20000; ++i) {
    const std::array codes{BTN_THUMBR, BTN_TR2, BTN_THUMBL};
    const int code = codes[random() % 3], value = static_cast<int>(random() % 3);
    decoder.take(event(EV_KEY, code, value));
    if (value < 2 && code == BTN_THUMBR) down = value == 1;
    if (value < 2 && code == BTN_TR2) through = value == 1;
    ASSERT_EQ(decoder.reading().contacts.first, down);
    ASSERT_EQ(decoder.reading().contacts.through, through);
  }
}

// A device that this test plugs in and out: its events come through a pipe, its keys' state from a table.
struct Plug {
  std::map<int, bool> down;
  std::array<int, 2> ends{-1, -1};
  bool there = true;
  int opened = 0;

  SwitchDevice::Kernel kernel() {
    return {[this](const SwitchKeys&, std::string& name) {
              name = there ? "a pipe" : "no pipe";
              if (!there) return -1;
              EXPECT_EQ(pipe2(ends.data(), O_NONBLOCK), 0);
              ++opened;
              return ends[0];
            },
            [this](int, int key) { return there ? (down[key] ? 1 : 0) : -1; }};
  }
  void press(int key, bool is_down) {
    down[key] = is_down;
    send(event(EV_KEY, key, is_down ? 1 : 0));
  }
  void send(const input_event& e) const {
    EXPECT_EQ(write(ends[1], &e, sizeof e), static_cast<ssize_t>(sizeof e));
  }
  void unplug() {
    there = false;
    close(ends[1]);
    ends[1] = -1;
  }
  ~Plug() {
    if (ends[1] >= 0) close(ends[1]);
  }
};

TEST(SwitchDevice, SR19_ReadsItsStateAtTheStartItsEventsAndItsStateAgainWithoutEvents) {
  Plug plug;
  plug.down[BTN_THUMBR] = true;
  SwitchDevice device(keys(), plug.kernel());
  EXPECT_TRUE(device.wait(0).contacts.first) << "it was held before it was opened";
  plug.press(BTN_THUMBR, false);
  EXPECT_FALSE(device.wait(0).contacts.first);
  plug.press(BTN_THUMBR, true);
  plug.press(BTN_THUMBR, false);
  plug.press(BTN_THUMBR, true);
  const SwitchReading reading = device.wait(0);
  EXPECT_TRUE(reading.contacts.first);
  EXPECT_EQ(reading.let_go, 2U);
  plug.down[BTN_THUMBR] = false;  // an event that was lost
  EXPECT_FALSE(device.wait(0).contacts.first);
  plug.down[BTN_THUMBR] = true;
  plug.send(event(EV_SYN, SYN_DROPPED, 0));
  plug.send(event(EV_SYN, SYN_REPORT, 0));
  EXPECT_TRUE(device.wait(0).contacts.first);
}

TEST(SwitchDevice, SR19_IsNotReadFromTheMomentItIsUnpluggedAndFoundAgainWhenItIsBack) {
  Plug plug;
  SwitchDevice device(keys(), plug.kernel());
  plug.press(BTN_THUMBR, true);
  ASSERT_TRUE(device.wait(0).contacts.first);
  plug.unplug();
  const SwitchReading gone = device.wait(0);
  EXPECT_FALSE(gone.contacts.read || gone.contacts.first);
  EXPECT_FALSE(device.plugged_in());
  plug.there = true;
  EXPECT_TRUE(test::eventually([&] { return device.wait(1).contacts.read; }));
  EXPECT_EQ(plug.opened, 2);
  EXPECT_TRUE(device.wait(0).contacts.first) << "whether that counts is not the device's to say";
}

TEST(SwitchDevice, SR19_OneWhoseStateCannotBeReadIsGone) {
  Plug plug;
  SwitchDevice device(keys(), plug.kernel());
  ASSERT_TRUE(device.wait(0).contacts.read);
  plug.there = false;  // no event says so
  EXPECT_FALSE(device.wait(0).contacts.read);
}

TEST(SwitchInput, WritesWhatAMissingDeviceIsAndEndsAtOnce) {
  SwitchKeys none = keys();
  none.device = "/dev/input/there_is_none";
  core::Snapshot<SwitchReading> into;
  SwitchReading reading;
  {
    SwitchInput input(none, into, 0);
    ASSERT_TRUE(test::eventually([&] { return into.read(reading); }));
    EXPECT_FALSE(reading.contacts.read);
  }
  EnablingSwitchConfig config;
  config.keys = none;
  try {
    check_switch(config);
    FAIL() << "accepted";
  } catch (const core::MissingError& error) {
    EXPECT_NE(std::string(error.what()).find("there_is_none"), std::string::npos);
  }
}

}  // namespace
}  // namespace phantom::runtime

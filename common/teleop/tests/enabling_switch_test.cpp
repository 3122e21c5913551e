#include "common/teleop/coupling/enabling_switch.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <vector>

#include "tests/support/heap_guard.hpp"

namespace phantom::teleop {
namespace {

constexpr double kSwitchTick_s = 0.001;

// Limits in whole ticks and a half, so that a sum of ticks is on one side of them whatever its rounding.
struct Limits {
  int settle = 3, stale = 5, discrepancy = 8;
  EnablingSwitchParameters parameters() const {
    return {(settle + 0.5) * kSwitchTick_s, (stale + 0.5) * kSwitchTick_s,
            (discrepancy + 0.5) * kSwitchTick_s};
  }
};

constexpr SwitchContacts kLetGo{.read = true, .age_s = 0.0};
constexpr SwitchContacts kClosed{.read = true, .first = true, .second = true, .age_s = 0.0};
constexpr SwitchContacts kFirstOnly{.read = true, .first = true, .age_s = 0.0};
constexpr SwitchContacts kSecondOnly{.read = true, .second = true, .age_s = 0.0};
constexpr SwitchContacts kThrough{.read = true, .through = true, .age_s = 0.0};

// The rule said of the whole history, without state. Motion is permitted in the last tick if, after some tick
// in which the switch had been released for long enough, it was always heard, never pressed through and not
// at fault, and has been held for long enough for the first and only time.
class Twin {
 public:
  explicit Twin(const Limits& limits) : limits_(limits) {}
  bool permits(const SwitchContacts& now) {
    history_.push_back(now);
    const int n = last();
    if (faulty(n)) return false;
    for (int release = n; release >= 0; --release) {
      if (run(release, is_released) > limits_.settle) return held_once(release + 1, n);
      if (!sound(history_[release]) || history_[release].through) return false;
    }
    return false;
  }

 private:
  using Property = std::function<bool(const SwitchContacts&)>;
  bool sound(const SwitchContacts& c) const {
    return c.read && std::isfinite(c.age_s) && c.age_s <= limits_.parameters().stale_s;
  }
  Property is_released = [this](const SwitchContacts& c) {
    return sound(c) && !c.through && !c.first && !c.second;
  };
  Property is_held = [this](const SwitchContacts& c) {
    return sound(c) && !c.through && c.first && c.second;
  };
  Property differs = [this](const SwitchContacts& c) { return sound(c) && c.first != c.second; };
  int last() const { return static_cast<int>(history_.size()) - 1; }
  // Number of ticks up to `end` for which the property has held.
  int run(int end, const Property& property) const {
    int count = 0;
    while (end - count >= 0 && property(history_[static_cast<std::size_t>(end - count)])) ++count;
    return count;
  }
  bool faulty(int n) const {
    for (int k = n; k >= 0 && !(run(k, is_released) > limits_.settle); --k) {
      if (run(k, differs) > limits_.discrepancy) return true;
    }
    return false;
  }
  bool held_once(int from, int n) const {
    if (!(run(n, is_held) > limits_.settle)) return false;
    for (int k = from; k <= n - run(n, is_held); ++k) {
      if (run(k, is_held) > limits_.settle) return false;
    }
    return true;
  }

  Limits limits_;
  std::vector<SwitchContacts> history_;
};

SwitchState hold_for(EnablingSwitch& device, const SwitchContacts& contacts, int ticks) {
  SwitchState state{};
  for (int i = 0; i < ticks; ++i) state = device.step(contacts, kSwitchTick_s);
  return state;
}

SwitchContacts any_contacts(std::mt19937& random) {
  const double nan = std::numeric_limits<double>::quiet_NaN(),
               never = std::numeric_limits<double>::infinity();
  const std::vector<SwitchContacts> all{kLetGo,
                                        kLetGo,
                                        kLetGo,
                                        kClosed,
                                        kClosed,
                                        kClosed,
                                        kClosed,
                                        kClosed,
                                        kFirstOnly,
                                        kSecondOnly,
                                        kThrough,
                                        {},
                                        {true, true, true, true, 0.0},
                                        {true, true, true, false, nan},
                                        {true, true, true, false, never},
                                        {true, true, true, false, 0.0054},
                                        {true, true, true, false, 0.0056},
                                        {false, true, true, false, 0.0}};
  return all[random() % all.size()];
}

// Random presses of random length, of both contacts, one, none, old and missing ones.
TEST(EnablingSwitch, SR19_PermitsWhatTheRuleOverTheWholeHistoryPermits) {
  std::mt19937 random(3);
  int permitted = 0, refused = 0;
  for (int walk = 0; walk < 300; ++walk) {
    const Limits limits{static_cast<int>(random() % 4), 5, static_cast<int>(4 + random() % 8)};
    EnablingSwitch device(limits.parameters());
    Twin twin(limits);
    for (int part = 0; part < 25; ++part) {
      const SwitchContacts contacts = any_contacts(random);
      const auto ticks = static_cast<int>(1 + random() % 14);
      for (int i = 0; i < ticks; ++i) {
        const bool permits_now = permits(device.step(contacts, kSwitchTick_s));
        ASSERT_EQ(permits_now, twin.permits(contacts)) << "walk " << walk << ", part " << part;
        ++(permits_now ? permitted : refused);
      }
    }
  }
  EXPECT_GT(permitted, 1000);
  EXPECT_GT(refused, 1000);
}

TEST(EnablingSwitch, SR19_LettingGoOfEitherContactCountsInThatTick) {
  for (const SwitchContacts& let_go : {kLetGo, kFirstOnly, kSecondOnly, kThrough}) {
    EnablingSwitch device(Limits().parameters());
    hold_for(device, kLetGo, 10);
    ASSERT_EQ(hold_for(device, kClosed, 10), SwitchState::kHeld);
    EXPECT_FALSE(permits(device.step(let_go, kSwitchTick_s)));
    // Not by holding again: both contacts have to be seen released for a while.
    EXPECT_EQ(hold_for(device, kClosed, 100), SwitchState::kToBeReleased);
    hold_for(device, kLetGo, 10);
    EXPECT_EQ(hold_for(device, kClosed, 10), SwitchState::kHeld);
  }
}

TEST(EnablingSwitch, SR19_HoldingCountsAfterTheContactsHaveSettled) {
  EnablingSwitch device({.settle_s = 0.0205});
  hold_for(device, kLetGo, 100);
  int ticks = 1;
  while (device.step(kClosed, kSwitchTick_s) != SwitchState::kHeld && ticks < 1000) ++ticks;
  EXPECT_EQ(ticks, 21);
  // A contact that bounces while it closes.
  hold_for(device, kLetGo, 100);
  for (int i = 0; i < 50; ++i)
    EXPECT_FALSE(permits(device.step(i % 3 == 0 ? kFirstOnly : kClosed, kSwitchTick_s)));
  EXPECT_EQ(hold_for(device, kClosed, 25), SwitchState::kHeld);
}

TEST(EnablingSwitch, SR19_ASwitchThatIsTiedDownFromTheStartPermitsNothing) {
  EnablingSwitch device(Limits().parameters());
  EXPECT_EQ(hold_for(device, kClosed, 100000), SwitchState::kToBeReleased);
  hold_for(device, kLetGo, 2);  // too short to be a hand's
  EXPECT_EQ(hold_for(device, kClosed, 1000), SwitchState::kToBeReleased);
  hold_for(device, kLetGo, 4);
  EXPECT_EQ(hold_for(device, kClosed, 4), SwitchState::kHeld);
}

TEST(EnablingSwitch, SR19_PressedThroughPermitsNothingUntilItWasReleased) {
  EnablingSwitch device(Limits().parameters());
  hold_for(device, kLetGo, 10);
  hold_for(device, kClosed, 10);
  EXPECT_EQ(device.step(kThrough, kSwitchTick_s), SwitchState::kPressedThrough);
  EXPECT_EQ(hold_for(device, kClosed, 1000), SwitchState::kToBeReleased) << "back to the middle";
  EXPECT_EQ(hold_for(device, kLetGo, 4), SwitchState::kReleased);
  EXPECT_EQ(hold_for(device, kClosed, 4), SwitchState::kHeld);
}

TEST(EnablingSwitch, SR19_AnAbsentOldOrImpossibleOneIsReleasedAndHasToBeReleased) {
  const double nan = std::numeric_limits<double>::quiet_NaN(),
               never = std::numeric_limits<double>::infinity();
  SwitchContacts unplugged = kClosed;
  unplugged.read = false;
  for (const double age_s : {0.0, nan, never, 0.101, -never}) {
    EnablingSwitch device({.stale_s = 0.1});
    hold_for(device, kLetGo, 100);
    ASSERT_EQ(hold_for(device, kClosed, 100), SwitchState::kHeld);
    SwitchContacts old = age_s == 0.0 ? unplugged : kClosed;
    old.age_s = age_s == -never ? never : age_s;
    EXPECT_EQ(device.step(old, kSwitchTick_s), SwitchState::kAbsent) << age_s;
    EXPECT_EQ(hold_for(device, kClosed, 1000), SwitchState::kToBeReleased);
  }
  EnablingSwitch device({.stale_s = 0.1});
  hold_for(device, kLetGo, 100);
  SwitchContacts not_yet_old = kClosed;
  not_yet_old.age_s = 0.099;
  EXPECT_EQ(hold_for(device, not_yet_old, 100), SwitchState::kHeld);
}

TEST(EnablingSwitch, SR19_AContactThatSticksIsAFaultWithinTheTimeAndIsNeverOverlooked) {
  for (const SwitchContacts& stuck : {kFirstOnly, kSecondOnly}) {
    EnablingSwitch device({.discrepancy_s = 0.5005});
    hold_for(device, kLetGo, 100);
    hold_for(device, kClosed, 100);
    int ticks = 1;
    while (device.step(stuck, kSwitchTick_s) != SwitchState::kContactsDiffer && ticks < 10000) ++ticks;
    EXPECT_EQ(ticks, 501);
    EXPECT_EQ(component_state(SwitchState::kContactsDiffer), core::ComponentState::kFault);
    for (int i = 0; i < 20; ++i) {  // the operator tries again and again, quickly and slowly
      EXPECT_FALSE(permits(hold_for(device, kClosed, 30 * i + 1)));
      EXPECT_FALSE(permits(hold_for(device, stuck, 50 * i + 1)));
    }
    hold_for(device, kLetGo, 100);
    EXPECT_EQ(hold_for(device, kClosed, 100), SwitchState::kHeld) << "it is mended";
  }
}

TEST(EnablingSwitch, EveryReasonIsSaidInWords) {
  for (const auto state : {SwitchState::kReleased, SwitchState::kToBeReleased, SwitchState::kPressedThrough,
                           SwitchState::kAbsent, SwitchState::kContactsDiffer}) {
    EXPECT_STRNE(reason_of(state), "");
    EXPECT_FALSE(permits(state));
  }
  EXPECT_TRUE(permits(SwitchState::kNotFitted));
}

TEST(EnablingSwitch, AllocatesNothing) {
  EnablingSwitch device(Limits().parameters());
  const test::HeapGuard guard;
  hold_for(device, kLetGo, 10);
  hold_for(device, kClosed, 10);
}

}  // namespace
}  // namespace phantom::teleop

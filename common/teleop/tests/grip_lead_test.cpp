#include "common/teleop/gripper/grip_lead.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

namespace phantom::teleop {
namespace {

constexpr double kWidest_m = 0.1;
constexpr core::Nanoseconds kTick_ns = 10 * core::kNsPerMillisecond;

/// A grip, and a gripper that has each request in force `delay` ticks later.
struct Rig {
  GripLead lead;
  GripLead::Gripper gripper{.status = {.sense = {.known = true, .follows = true}}, .widest_m = kWidest_m};
  double opening = 1.0;
  bool may = true;
  int delay = 3;
  core::Nanoseconds now_ns = core::kNsPerSecond;
  std::vector<std::pair<core::Nanoseconds, double>> requests;  // when, width
  std::vector<std::pair<core::Nanoseconds, double>> underway;

  void tick() {
    now_ns += kTick_ns;
    while (!underway.empty() && underway.front().first <= now_ns) {
      gripper.status.requested_width_m = underway.front().second;
      underway.erase(underway.begin());
    }
    if (const auto width_m = lead.step(opening, may, gripper, now_ns)) {
      requests.emplace_back(now_ns, *width_m);
      underway.emplace_back(now_ns + delay * kTick_ns, *width_m);
    }
  }
  void run(double seconds) {
    for (int i = 0; i < std::lround(seconds * 100); ++i) tick();
  }
  void move_to(double to, double seconds) {
    const int ticks = static_cast<int>(std::lround(seconds * 100));
    const double from = opening;
    for (int i = 1; i <= ticks; ++i) {
      opening = from + (to - from) * i / ticks;
      tick();
    }
  }
  void request_by_another(double width_m) { gripper.status.requested_width_m = width_m; }
  double in_force_m() const { return gripper.status.requested_width_m; }
};

TEST(GripLead, AnOpenGripOpensNoFingersThatAreClosed) {
  Rig rig;  // closed on something, and the trigger is not pulled
  rig.run(2.0);
  rig.move_to(0.3, 0.5);
  rig.move_to(1.0, 0.5);
  EXPECT_TRUE(rig.requests.empty());
  EXPECT_FALSE(rig.lead.leads());
}

TEST(GripLead, TakesTheGripperWhereBothAgreeAndLeadsItFromThere) {
  Rig rig;
  rig.move_to(0.0, 0.5);
  EXPECT_TRUE(rig.lead.leads());
  EXPECT_TRUE(rig.requests.empty()) << "to take it moves nothing";
  rig.move_to(0.6, 1.0);
  rig.run(0.2);
  EXPECT_NEAR(rig.in_force_m(), 0.06, GripLead::kStep * kWidest_m);
  rig.move_to(1.0, 0.5);
  rig.run(0.2);
  EXPECT_EQ(rig.in_force_m(), kWidest_m);
  rig.move_to(0.0, 0.3);
  rig.run(0.2);
  EXPECT_EQ(rig.in_force_m(), 0.0) << "closed whole, so that it presses";
}

TEST(GripLead, TakesAGripperThatItPassesBetweenTwoSamples) {
  for (const double from : {1.0, 0.0}) {
    Rig rig;
    rig.request_by_another(0.05);
    rig.opening = from;
    rig.run(0.1);
    EXPECT_FALSE(rig.lead.leads());
    rig.opening = 1.0 - from;
    rig.run(0.1);
    EXPECT_TRUE(rig.lead.leads());
    EXPECT_EQ(rig.in_force_m(), (1.0 - from) * kWidest_m);
  }
}

TEST(GripLead, LosesItAndHasToComeThereAgain) {
  const auto lose = [](int way, Rig& rig) {
    switch (way) {
      case 0:
        rig.may = false;
        break;
      case 1:
        rig.gripper.status.sense.fault = true;
        break;
      case 2:
        rig.gripper.status.sense.follows = false;
        break;
      case 3:
        rig.gripper.widest_m = 0.0;
        break;
      case 4:
        rig.opening = -1.0;
        break;
      case 5:
        rig.opening = std::numeric_limits<double>::quiet_NaN();
        break;
      default:
        rig.request_by_another(0.031);
    }
  };
  for (int way = 0; way <= 6; ++way) {
    SCOPED_TRACE(way);
    Rig rig;
    rig.move_to(0.0, 0.2);
    rig.move_to(0.5, 0.5);
    rig.run(0.3);
    ASSERT_TRUE(rig.lead.leads());
    lose(way, rig);
    rig.tick();
    EXPECT_FALSE(rig.lead.leads());
    // What was lost is there again, with the fingers closed and the grip half open.
    rig.may = true;
    rig.gripper = {.status = {.sense = {.known = true, .follows = true}}, .widest_m = kWidest_m};
    rig.request_by_another(0.0);
    rig.opening = 0.5;
    rig.requests.clear();
    rig.move_to(0.9, 0.5);
    EXPECT_TRUE(rig.requests.empty());
    rig.move_to(0.0, 0.5);
    EXPECT_TRUE(rig.lead.leads());
  }
}

TEST(GripLead, FingersThatAnotherHasClosedAreNotOpenedThoughTheGripWasClosedBefore) {
  Rig rig;
  rig.move_to(0.0, 0.2);
  rig.move_to(0.5, 0.5);
  rig.run(2.0);
  rig.request_by_another(0.0);
  rig.requests.clear();
  rig.run(0.1);
  rig.move_to(1.0, 0.5);
  EXPECT_TRUE(rig.requests.empty());
  EXPECT_EQ(rig.in_force_m(), 0.0);
}

TEST(GripLead, ItsOwnRequestsThatComeIntoForceLateAreNobodyElses) {
  Rig rig;
  rig.delay = 40;  // 0.4 s
  rig.move_to(0.0, 0.2);
  rig.run(0.5);
  for (int i = 0; i < 20; ++i) {
    rig.move_to(i % 2 == 0 ? 1.0 : 0.0, 0.3);
    EXPECT_TRUE(rig.lead.leads()) << i;
  }
}

// Whatever the hand does: few requests, each of a width that it can have, none without the right to lead; and
// a hand that rests asks for nothing.
TEST(GripLead, RequestsAreFewAndWithinTheGripper) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> place(0.0, 1.0);
  for (int run = 0; run < 50; ++run) {
    Rig rig;
    rig.delay = 1 + run % 7;
    rig.request_by_another(kWidest_m * place(random));
    for (int move = 0; move < 20; ++move) {
      rig.may = place(random) < 0.8;
      const std::size_t before = rig.requests.size();
      rig.move_to(place(random), 0.05 + 0.3 * place(random));
      EXPECT_TRUE(rig.may || rig.requests.size() == before);
    }
    rig.may = true;
    rig.run(0.5);
    const std::size_t rested = rig.requests.size();
    rig.run(1.0);
    EXPECT_EQ(rig.requests.size(), rested);
    if (rig.lead.leads()) {
      EXPECT_NEAR(rig.in_force_m(), rig.opening * kWidest_m, 1.0001 * GripLead::kStep * kWidest_m);
    }
    for (std::size_t i = 0; i < rig.requests.size(); ++i) {
      EXPECT_GE(rig.requests[i].second, 0.0);
      EXPECT_LE(rig.requests[i].second, kWidest_m);
      if (i == 0) continue;
      EXPECT_GE(rig.requests[i].first - rig.requests[i - 1].first, GripLead::kEvery_ns);
    }
  }
}

}  // namespace
}  // namespace phantom::teleop

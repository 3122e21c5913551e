#include "common/runtime/fields.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/files.hpp"

namespace phantom::runtime {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

enum class Mood { kCalm, kBrisk };

constexpr const char* kCartTable = R"(# A cart: how long it is,
# and how it goes.

length_mm: 250           # [1 to 1000 mm] from end to end,
                         # seats: not a key, as the comment goes on
angle_deg: 5             # [required: -90 to 90 deg]
name: ""                 # may be: anything
weights: []              # [0 to 1 kg]
seat_m: [0, 0.5, -1]
ride:                    # how it goes
  pause_s: 2             # [0 to 10 s; 0: none; left out: 3] at each stop
  seats: 4               # [1 to 9]
  bell: true
  mood: calm             # [calm, brisk]
  # joints:              # of single joints
  #   NAME:
  #     gain: 1          # [required: 0 to 5]
wheels:
  - node: 1              # [required: 1 to 127]
    radius_m: 0.1        # [0 to 1 m]
  - node: 2
# brake:
#   force_N: 3           # [0 to 100 N]
)";

struct Wheel {
  int node = 0;
  double radius_m = 0.25;
};

struct Cart {
  double length_m = 0.25, angle_rad = 0.0, force_N = 0.0;
  long pause_ns = 3'000'000'000;
  std::size_t seats = 2;
  bool bell = true;
  std::string name = "none";
  Mood mood = Mood::kCalm;
  std::vector<double> weights;
  Eigen::Vector3d seat_m{0, 0.5, -1};
  std::vector<Wheel> wheels;
  double gains[2] = {1, 1};
};

Cart cart(const std::string& yaml) {
  const Fields file(test::new_file(yaml), {kCartTable});
  Cart cart;
  file.number("length_mm", cart.length_m, 1e-3);
  file.number("angle_deg", cart.angle_rad, 0.01);
  file.text("name", cart.name);
  file.numbers("weights", cart.weights);
  file.vector3("seat_m", cart.seat_m);
  const Fields ride = file.section("ride");
  ride.number("pause_s", cart.pause_ns, 1e9);
  ride.check(cart.pause_ns != 4'000'000'000, "pause_s", "is four; allowed: anything else");
  ride.number("seats", cart.seats);
  ride.flag("bell", cart.bell);
  ride.choice("mood", cart.mood, {{"calm", Mood::kCalm}, {"brisk", Mood::kBrisk}});
  ride.named("joints", {"left", "right"},
             [&](const Fields& own, std::size_t j) { own.number("gain", cart.gains[j]); });
  for (const Fields& item : file.sections("wheels")) {
    Wheel& wheel = cart.wheels.emplace_back();
    item.number("node", wheel.node);
    item.number("radius_m", wheel.radius_m);
  }
  file.section("brake").number("force_N", cart.force_N);
  file.finish();
  return cart;
}

TEST(Fields, ReadEveryKindAndLeaveTheMemberWhereAKeyIsMissing) {
  const Cart all = cart(
      "length_mm: 500\nangle_deg: 30\nride: {pause_s: 0.2, seats: 3, bell: false, mood: brisk, joints: "
      "{right: {gain: 3}}}\nname: Ann\nweights: [0.5, 1]\nseat_m: [1, 2, 3]\nwheels: [{node: 7}, {node: "
      "8, radius_m: 0.3}]\nbrake: {force_N: 9}\n");
  EXPECT_DOUBLE_EQ(all.length_m, 0.5);
  EXPECT_DOUBLE_EQ(all.angle_rad, 0.3);
  EXPECT_EQ(all.pause_ns, 200'000'000);
  EXPECT_EQ(all.seats, 3u);
  EXPECT_FALSE(all.bell);
  EXPECT_EQ(all.mood, Mood::kBrisk);
  EXPECT_EQ(all.name, "Ann");
  EXPECT_EQ(all.weights, (std::vector<double>{0.5, 1}));
  EXPECT_EQ(all.seat_m, Eigen::Vector3d(1, 2, 3));
  ASSERT_EQ(all.wheels.size(), 2u);
  EXPECT_EQ(all.wheels[0].node, 7);
  EXPECT_EQ(all.wheels[0].radius_m, 0.25);
  EXPECT_EQ(all.wheels[1].radius_m, 0.3);
  EXPECT_EQ(all.gains[0], 1);
  EXPECT_EQ(all.gains[1], 3);
  EXPECT_EQ(all.force_N, 9);
  const Cart least = cart("angle_deg: 0");
  EXPECT_EQ(least.length_m, 0.25);
  EXPECT_EQ(least.pause_ns, 3'000'000'000);
  EXPECT_EQ(least.name, "none");
  EXPECT_TRUE(least.wheels.empty());
}

TEST(Fields, TheTableIsAFileItself) {
  const Cart shipped = cart(kCartTable);
  EXPECT_DOUBLE_EQ(shipped.angle_rad, 0.05);
  EXPECT_EQ(shipped.seats, 4u);
  EXPECT_EQ(shipped.wheels.size(), 2u);
  EXPECT_EQ(shipped.force_N, 0.0) << "a comment";
}

TEST(Fields, EveryFaultNamesFileLineKeyValueAndWhatTheTableAllows) {
  const auto refused = [](const std::string& yaml, const std::string& told) {
    EXPECT_THAT([&] { cart("angle_deg: 1\n" + yaml); },
                ThrowsMessage<ConfigError>(HasSubstr(".yaml:2: " + told)));
  };
  refused("length_mm: 0.5", "length_mm: '0.5' is out of range; allowed: 1 to 1000 mm");
  refused("weights: [2]", "weights: is out of range; allowed: 0 to 1 kg");
  refused("ride: {seats: 2.5}", "ride.seats: '2.5' is not a whole number");
  refused("ride: {pause_s: -1}", "ride.pause_s: '-1' is out of range; allowed: 0 to 10 s; 0: none");
  refused("ride: {pause_s: 4}", "ride.pause_s: '4' is four; allowed: anything else");
  refused("ride: {bell: perhaps}", "ride.bell: 'perhaps' is not true or false");
  refused("ride: {mood: sad}", "ride.mood: 'sad' is not known; allowed: calm, brisk");
  refused("ride: 3", "ride: '3' is '3'; allowed: a mapping");
  refused("wheels: [{node: 300}]", "wheels[0].node: '300' is out of range; allowed: 1 to 127");
  refused("wheels: [{node: 3, nodes: 3}]",
          "wheels[0].nodes: unknown key (did you mean node?); allowed: node, radius_m");
  refused("ride: {joints: {middle: {gain: 1}}}", "ride.joints.middle: unknown key; allowed: left, right");
  refused("ride: {joints: {left: {}}}", "ride.joints.left.gain: is missing; allowed: 0 to 5");
  refused("brake: {force_N: 101}", "brake.force_N: '101' is out of range; allowed: 0 to 100 N");
  EXPECT_THAT([] { cart("name: Ann"); },
              ThrowsMessage<ConfigError>(HasSubstr("angle_deg: is missing; allowed: -90 to 90 deg")));
}

TEST(Fields, WhatTheTableDoesNotHaveIsAMistakeOfTheCode) {
  const Fields file(test::new_file("{}"), {kCartTable});
  int number = 0;
  EXPECT_THROW(file.number("seats", number), std::logic_error)
      << "it stands in section ride, and in a comment";
  EXPECT_THROW(file.section("ride").choice("mood", number, {{"brisk", 1}, {"calm", 2}}), std::logic_error);
}

}  // namespace
}  // namespace phantom::runtime

#include "components/master_io/devices/haptic_device.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <deque>
#include <functional>

#include "common/simulation/handle_plant.hpp"
#include "components/master_io/dds_adapter_convert.hpp"
#include "components/master_io/servo.hpp"
#include "components/master_io/tests/fixture.hpp"
#include "tests/support/heap_guard.hpp"

namespace phantom::master_io {
namespace {

using teleop::LinkState;
using testing::HasSubstr;
constexpr double kPeriod_s = 0.001;
constexpr std::uint64_t kMasterSession = 42;
const std::filesystem::path kSite = PHANTOM_SOURCE_DIR "/deploy/cartesian/hot_cell_haptic_device.yaml";

Config haptic_config() {
  return load_config(kSite, hot_cell().file, shipped_arm().arm, shipped_arm().home, {});
}

/// The servo, a slave that follows perfectly, and a device that another process serves: a handle with mass,
/// on which a hand pushes. What both send each other takes `way_ns`.
struct HapticRig : ServoRig {
  using Hand = std::function<robot::Spatial(const simulation::HandlePlant&)>;

  explicit HapticRig(const Config& chosen = haptic_config())
      : config(chosen),
        plant(handle(config)),
        device(config, shipped_arm().arm, shipped_arm().home, inbox.haptic),
        servo(config, shipped_arm().home, device, inbox, 1, stops) {
    slave.position = last.position = shipped_arm().home;
    drag.drag.plus.fill(0.1);
    drag.drag.minus.fill(0.1);
    state.ready = true;
    state.able = {messages::kAllAxes, messages::kAllAxes, 15.0, 1.0, 1.0, 0.02, 0.15, 1.2, kPeriod_s};
    state.stamp.session = 7;
  }
  static simulation::HandlePlantParameters handle(const Config& config) {
    simulation::HandlePlantParameters handle;
    handle.moved = {.inertia = config.cartesian->hand.map.mass_kg, .lower = -0.15, .upper = 0.15};
    handle.turned = {.inertia = config.cartesian->hand.map.inertia_kg_m2, .lower = -1.2, .upper = 1.2};
    handle.force_limit_N = 15.0;
    handle.moment_limit_N_m = 1.0;
    return handle;
  }

  void step_device() {
    while (!down.empty() && down.front().first <= now_ns) {
      acting = down.front().second;
      acting_since_ns = down.front().first;
      down.pop_front();
    }
    const double share = acting.valid ? share_at_age(acting, core::seconds(now_ns - acting_since_ns)) : 0.0;
    robot::Spatial wrench;
    for (int i = 0; i < 3; ++i) {
      wrench[i] = share * acting.force_N[static_cast<std::size_t>(i)];
      wrench[i + 3] = share * acting.moment_N_m[static_cast<std::size_t>(i)];
    }
    const robot::Spatial push = hand ? hand(plant) : robot::Spatial::Zero();
    exerted = plant.motors();
    plant.step(push, wrench, kPeriod_s);
    energy_from_hand_J -= exerted.dot(plant.true_twist()) * kPeriod_s;
    ++state.stamp.sequence_number;
    state.stamp.monotonic_ns = now_ns;
    state.wrench_echo = acting.stamp;
    Eigen::Map<Eigen::Matrix3d>(state.handle.R_DH.data()) = plant.pose().rotation;
    for (int i = 0; i < 3; ++i) {
      const auto k = static_cast<std::size_t>(i);
      state.handle.position_m[k] = plant.pose().translation_m[i] + jump_m[i];
      state.handle.velocity_m_s[k] = plant.twist()[i];
      state.handle.angular_velocity_rad_s[k] = plant.twist()[i + 3];
    }
    if (device_heard) up.emplace_back(now_ns + way_ns, state);
  }

  void run(double duration_s) {
    for (double t = 0; t < duration_s; t += kPeriod_s) {
      now_ns += core::from_seconds(kPeriod_s);
      if (heard) {
        renew(slave);
        renew(drag);
        if (last.outputs.state != LinkState::kInit) slave.position = last.position;
        inbox.slave.write(slave);
        inbox.drag.write(drag);
      }
      step_device();
      for (; !up.empty() && up.front().first <= now_ns; up.pop_front()) {
        const messages::HapticDevice& sample = up.front().second;
        inbox.haptic.write({sample, sample.wrench_echo, now_ns, kMasterSession});
      }
      const auto before = last.wrench;
      const auto was_at = last.position;
      {
        const test::HeapGuard guard;
        tick(servo, kPeriod_s);
      }
      check(before, was_at);
      messages::HapticDeviceWrench wrench = last.wrench;
      wrench.stamp.session = kMasterSession;
      wrench.stamp.sequence_number = ++sent;
      down.emplace_back(now_ns + way_ns, wrench);
    }
  }

  void check(const messages::HapticDeviceWrench& before, const core::JointArray& was_at) {
    double change_N = 0.0, percept_W = 0.0;
    for (std::size_t i = 0; i < 3; ++i)
      change_N = std::hypot(change_N, last.wrench.force_N[i] - before.force_N[i]);
    // What is no longer valid may fall at once: the device fades it.
    if (last.wrench.valid) greatest_rise_N = std::max(greatest_rise_N, change_N);
    for (std::size_t j = 0; j < 7; ++j) {
      percept_W += last.percept_torque_Nm[j] * last.velocity[j];
      const double most = shipped_arm().arm.joints()[j].max_speed * kPeriod_s;
      if (was_at != core::JointArray{}) {
        EXPECT_LE(std::abs(last.position[j] - was_at[j]), most) << "joint " << j << " jumped";
      }
    }
    EXPECT_LE(percept_W, 1e-12);
  }

  double force_N() const { return Eigen::Map<const Eigen::Vector3d>(last.wrench.force_N.data()).norm(); }
  Eigen::Vector3d tool() const { return tool_pose_at(shipped_arm().arm, last.position).translation_m; }
  std::string message() { return device.health().message; }
  /// Couples with the clutch out, then lets it in.
  void couple_and_lead() {
    state.clutch = false;
    run(1.0);
    ASSERT_EQ(last.outputs.state, LinkState::kCoupled) << message();
    state.clutch = true;
    run(0.4);
    ASSERT_TRUE(last.wrench.leads);
  }
  /// A hand that draws the handle to and fro along the device's y.
  static Hand swinging() {
    return [t = 0.0](const simulation::HandlePlant& plant) mutable {
      t += kPeriod_s;
      robot::Spatial push = -30.0 * plant.true_twist();
      push.head<3>() -= 300.0 * plant.pose().translation_m;
      push[1] += 300.0 * 0.05 * std::min(1.0, t) * std::sin(6.283 * 0.7 * t);
      push.tail<3>() *= 0.01;
      return push;
    };
  }

  Config config;
  simulation::HandlePlant plant;
  HapticDevice device;
  Servo servo;
  Hand hand;
  messages::HapticDevice state;
  messages::HapticDeviceWrench acting;
  core::Nanoseconds acting_since_ns = 0, way_ns = 300'000;
  std::deque<std::pair<core::Nanoseconds, messages::HapticDevice>> up;
  std::deque<std::pair<core::Nanoseconds, messages::HapticDeviceWrench>> down;
  robot::Spatial exerted = robot::Spatial::Zero();
  Eigen::Vector3d jump_m = Eigen::Vector3d::Zero();
  std::uint64_t sent = 0;
  bool device_heard = true;
  double energy_from_hand_J = 0.0, greatest_rise_N = 0.0;
};

TEST(HapticDevice, LeadsTheToolAndItsDragTakesEnergyFromTheHand) {
  HapticRig rig;
  rig.couple_and_lead();
  EXPECT_EQ(rig.last.reach, -1) << "nothing is scripted";
  const Eigen::Vector3d start = rig.tool(), handle_start = rig.plant.pose().translation_m;
  rig.hand = HapticRig::swinging();
  double farthest_m = 0.0, most_N = 0.0, worst_m = 0.0;
  for (int i = 0; i < 60; ++i) {
    rig.run(0.1);
    const Eigen::Vector3d moved = rig.tool() - start, led = rig.plant.pose().translation_m - handle_start;
    farthest_m = std::max(farthest_m, moved.norm());
    worst_m = std::max(worst_m, (moved - rig.config.cartesian->hand.scale * led).norm());
    most_N = std::max(most_N, rig.force_N());
  }
  EXPECT_GT(farthest_m, 0.03);
  EXPECT_LT(worst_m, 0.3 * farthest_m) << "the tool follows the hand, scaled";
  EXPECT_GT(most_N, 0.3) << "drag is felt";
  EXPECT_GT(rig.energy_from_hand_J, 0.01) << "over the loop with its delay";
  EXPECT_LE(rig.greatest_rise_N, rig.config.cartesian->wrench.force_rate_N_per_s * kPeriod_s + 1e-9);
}

// Feedback that pushes as the hand goes: what the cap keeps from the hand, the passivity guard does not
// count.
TEST(HapticDevice, SR13_TheGuardCountsWhatAWeakHandRendersAndNoMore) {
  for (const bool weak : {true, false}) {
    Config config = haptic_config();
    if (weak) config.cartesian->wrench.force_cap_N = config.cartesian->wrench.moment_cap_N_m = 0.01;
    HapticRig rig(config);
    rig.couple_and_lead();
    rig.hand = HapticRig::swinging();
    bool damped = false;
    for (double t = 0.0; t < 3.0; t += kPeriod_s) {
      for (std::size_t j = 0; j < 7; ++j)
        rig.slave.loop_torque_Nm[j] = -1000.0 * std::clamp(20.0 * rig.last.velocity[j], -1.0, 1.0);
      rig.run(kPeriod_s);
      damped = damped || rig.last.feedback_damped;
    }
    EXPECT_EQ(damped, !weak);
  }
}

TEST(HapticDevice, WithoutTheClutchNothingIsLedAndNothingFelt) {
  HapticRig rig;
  rig.couple_and_lead();
  rig.state.clutch = false;
  rig.run(0.3);
  const Eigen::Vector3d held = rig.tool();
  rig.hand = HapticRig::swinging();
  rig.run(2.0);
  EXPECT_LT((rig.tool() - held).norm(), 1e-12);
  EXPECT_EQ(rig.force_N(), 0.0);
  EXPECT_TRUE(rig.last.wrench.valid);
  EXPECT_FALSE(rig.last.wrench.leads);
  EXPECT_EQ(rig.last.outputs.state, LinkState::kCoupled);
}

TEST(HapticDevice, AClutchThatIsHeldClosedFromTheStartLeadsNothing) {
  HapticRig rig;
  rig.state.clutch = true;
  rig.run(2.0);
  EXPECT_NE(rig.last.outputs.state, LinkState::kCoupled);
  EXPECT_THAT(rig.message(), HasSubstr("let the clutch out"));
  EXPECT_FALSE(rig.last.wrench.valid);
}

/// Loses the device while it leads under drag; returns after it is back and leads again.
void expect_defined_loss(HapticRig& rig, const std::function<void()>& lose, double within_s,
                         const std::function<void()>& restore, const std::string& words) {
  rig.hand = HapticRig::swinging();
  rig.couple_and_lead();
  for (int i = 0; i < 3000 && rig.force_N() < 0.5; ++i) rig.run(kPeriod_s);
  ASSERT_GE(rig.force_N(), 0.5);
  lose();
  rig.run(within_s + 2 * kPeriod_s);
  EXPECT_FALSE(rig.last.wrench.valid);
  EXPECT_EQ(rig.force_N(), 0.0);
  EXPECT_EQ(rig.last.outputs.state, LinkState::kDegraded);
  EXPECT_THAT(rig.message(), HasSubstr(words));
  const core::JointArray lost_at = rig.last.position;
  rig.run(rig.config.cartesian->hand.clutch_fade_s);
  const core::JointArray stands = rig.last.position;
  for (std::size_t j = 0; j < 7; ++j) EXPECT_NEAR(stands[j], lost_at[j], 0.02);
  rig.run(1.0);
  for (std::size_t j = 0; j < 7; ++j) EXPECT_NEAR(rig.last.position[j], stands[j], 1e-9);
  EXPECT_EQ(rig.exerted.norm(), 0.0) << "the device exerts nothing any more";
  restore();
  rig.run(2.0);
  EXPECT_NE(rig.last.outputs.state, LinkState::kCoupled) << "the hand held the clutch in all the while";
  EXPECT_THAT(rig.message(), HasSubstr("clutch out"));
  rig.hand = {};
  rig.couple_and_lead();
  EXPECT_EQ(rig.message(), "");
}

TEST(HapticDevice, SR07_OneThatFallsSilentIsLostWithinTheStaleness) {
  HapticRig rig;
  expect_defined_loss(
      rig, [&] { rig.device_heard = false; }, rig.config.cartesian->watch.staleness_s + 0.001,
      [&] { rig.device_heard = true; }, "no haptic device that fits is heard");
}

TEST(HapticDevice, SR10_OneWhosePoseJumpsIsNotFollowed) {
  HapticRig rig;
  expect_defined_loss(
      rig,
      [&] {
        rig.jump_m = {0, 0.02, 0};
      },
      0.001, [] {}, "pose jumped");
}

TEST(HapticDevice, OneThatIsNotReadyIsNotFollowed) {
  HapticRig rig;
  expect_defined_loss(
      rig, [&] { rig.state.ready = false; }, 0.001, [&] { rig.state.ready = true; }, "not ready");
}

TEST(HapticDevice, SR11_OneThatIsRestartedIsNotFollowed) {
  HapticRig rig;
  expect_defined_loss(
      rig, [&] { rig.state.stamp.session = 8; }, 0.001, [] {}, "another process");
}

TEST(HapticDevice, SR07_OneWhoseLoopIsTooLongIsLost) {
  HapticRig rig;
  expect_defined_loss(
      rig, [&] { rig.way_ns = 40'000'000; }, rig.config.cartesian->watch.round_trip_limit_s,
      [&] { rig.way_ns = 300'000; }, "");
}

TEST(HapticDevice, SR13_ALongerLoopIsRenderedWithLessDragAndComesToRest) {
  const double limit_of_site = haptic_config().percept.damping_limit_Nms_per_rad[3];
  for (const int way_ms : {0, 2, 5, 10}) {
    Config config = haptic_config();
    config.feedback.law = teleop::BilateralLaw::kPf;
    HapticRig rig(config);
    rig.way_ns = way_ms * 1'000'000;
    rig.drag.drag.plus.fill(10.0 * limit_of_site);  // much more than is stable
    rig.drag.drag.minus.fill(10.0 * limit_of_site);
    rig.couple_and_lead();
    EXPECT_TRUE(rig.last.outputs.damping_limited);
    rig.hand = HapticRig::swinging();
    rig.run(2.0);
    rig.hand = {};  // nobody holds it, and friction is left out
    rig.run(0.1);
    const double before = rig.plant.true_twist().head<3>().norm();
    rig.run(2.0);
    EXPECT_LT(rig.plant.true_twist().head<3>().norm(), std::max(0.01, 0.2 * before)) << way_ms << " ms";
    EXPECT_GT(rig.energy_from_hand_J, 0.0);
    EXPECT_TRUE(way_ms < 10 || rig.last.percept_gain < 0.25 * rig.config.percept_gain[0]);
  }
}

TEST(Actuated, AWrenchWithoutSomeAxesNeverGivesMorePowerThanTheWhole) {
  std::uint32_t seed = 1;
  const auto number = [&] {
    seed = seed * 1664525U + 1013904223U;
    return static_cast<double>(seed >> 8) / 8388608.0 - 1.0;
  };
  for (int i = 0; i < 20000; ++i) {
    robot::Spatial wrench, twist;
    for (int k = 0; k < 6; ++k) wrench[k] = 10.0 * number(), twist[k] = number();
    const std::uint32_t axes = seed >> 13 & messages::kAllAxes;
    const robot::Spatial left = actuated(wrench, axes, twist);
    EXPECT_LE(left.dot(twist), std::max(0.0, wrench.dot(twist)) + 1e-9);
    for (int k = 0; k < 6; ++k) {
      EXPECT_TRUE((axes >> k & 1U) != 0 || left[k] == 0.0);
      EXPECT_LE(std::abs(left[k]), std::abs(wrench[k]) + 1e-12);
    }
  }
  const robot::Spatial ones = robot::Spatial::Ones();
  EXPECT_EQ(actuated(ones, messages::kAllAxes, ones), ones);
}

TEST(HapticDevice, SR11_OneThatDoesNotFitIsRefusedWithTheKeyAndWhatIsAllowed) {
  const HapticNeeds needs{1.0, 0.02, 15.0, 1.0, true};
  messages::HapticDevice device;
  device.able = {messages::kAllAxes, messages::kAllAxes, 15.0, 1.0, 1.0, 0.02, 0.15, 1.2, kPeriod_s};
  EXPECT_EQ(refusal(device, needs), "");
  const auto with = [&](auto change) {
    messages::HapticDevice other = device;
    change(other.able);
    return refusal(other, needs);
  };
  EXPECT_EQ(with([](auto& able) { able.mass_kg = 0.25; }),
            "its mass_kg is 0.25, cartesian.mass_kg 1; allowed: no more");
  EXPECT_THAT(with([](auto& able) { able.inertia_kg_m2 = 0.01; }), HasSubstr("cartesian.inertia_kg_m2"));
  EXPECT_THAT(with([](auto& able) { able.max_force_N = 3.3; }), HasSubstr("cartesian.force_limit_N 15"));
  EXPECT_THAT(with([](auto& able) { able.max_moment_N_m = 0.5; }), HasSubstr("cartesian.moment_limit_N_m"));
  EXPECT_EQ(with([](auto& able) { able.max_moment_N_m = 0.0, able.actuated_axes = 7; }), "")
      << "it has no moments, and says so";
  EXPECT_THAT(with([](auto& able) { able.measured_axes = 7; }), HasSubstr("orientation: false"));
}

}  // namespace
}  // namespace phantom::master_io

#include "components/master_io/cartesian_lead.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "common/teleop/guards/passivity_guard.hpp"
#include "components/master_io/tests/fixture.hpp"

namespace phantom::master_io {
namespace {

constexpr double kReachTick_s = 0.001;
const std::filesystem::path kHapticSite = PHANTOM_SOURCE_DIR "/deploy/cartesian/hot_cell_haptic_device.yaml";

/// Reaches of a hand between random poses, each of minimum jerk.
class RandomReaches {
 public:
  explicit RandomReaches(std::uint32_t seed) : random_(seed) { aim(); }

  geometry::Pose next() {
    t_ += kReachTick_s / duration_s_;
    const double s = t_ * t_ * t_ * (10.0 - 15.0 * t_ + 6.0 * t_ * t_);
    const robot::Spatial at = from_ + s * (to_ - from_);
    if (t_ >= 1.0) aim();
    return {.rotation = geometry::rotation_from_vector(at.tail<3>()), .translation_m = at.head<3>()};
  }

 private:
  double any() { return std::uniform_real_distribution<double>(-1.0, 1.0)(random_); }
  void aim() {
    from_ = to_;
    for (int i = 0; i < 6; ++i) to_[i] = (i < 3 ? 0.1 : 0.6) * any();
    duration_s_ = 0.8 + 0.4 * any();
    t_ = 0.0;
  }

  std::mt19937 random_;
  robot::Spatial from_ = robot::Spatial::Zero(), to_ = robot::Spatial::Zero();
  double t_ = 0.0, duration_s_ = 1.0;
};

robot::Spatial displacement(const geometry::Pose& from, const geometry::Pose& to) {
  robot::Spatial moved;
  moved.head<3>() = to.translation_m - from.translation_m;
  moved.tail<3>() = geometry::rotation_vector(to.rotation * from.rotation.transpose());
  return moved;
}

/// Energies that were taken from the hand, J.
struct Balance {
  double at_hand = 0.0;        ///< by the wrench along the handle's displacement alone
  double of_guard = 0.0;       ///< less what the torques did on what the joints work off without the hand
  double without_share = 0.0;  ///< the same of a guard that does not hear of the caps
  double exchanged = 0.0;      ///< sum of the magnitudes at the hand
  int capped = 0;              ///< ticks
};

/// Feedback that pushes and brakes, on a hand that reaches at random and moves its clutch.
Balance balance_of(const CartesianConfig& config, std::uint32_t axes, std::uint32_t seed) {
  const robot::SerialArm& arm = shipped_arm().arm;
  CartesianLead lead(config, arm, shipped_arm().home);
  teleop::PassivityParameters all{.joint_count = arm.joint_count()};
  all.allowance_J.fill(1e9);
  all.store_J.fill(1e9);
  teleop::PassivityGuard guard(all), deaf(all);
  RandomReaches reaches(seed);
  std::mt19937 random(seed);
  teleop::HandState handle{.pose = reaches.next(), .clutch = true, .valid = true};
  DeviceSense sense;
  DeviceDemand demand{.coupled = true};
  core::JointArray led_to{};
  Balance balance;
  for (int i = 0; i < 30'000; ++i) {
    const geometry::Pose next = reaches.next();
    handle.twist = displacement(handle.pose, next) / kReachTick_s;
    if (random() % 2000 == 0) handle.clutch = !handle.clutch;
    lead.sense(handle, sense);
    guard.note_share(sense.rendered_share);
    for (std::size_t j = 0; i > 0 && j < arm.joint_count(); ++j) {
      const double alone_J = demand.motor_Nm[j] * (sense.position[j] - led_to[j]);
      balance.of_guard += sense.rendered_share * alone_J;
      balance.without_share += alone_J;
    }
    for (std::size_t j = 0; j < arm.joint_count(); ++j) {
      const double phase =
          (1.0 + 0.3 * static_cast<double>(j)) * 2.0 * i * kReachTick_s + static_cast<double>(j);
      demand.motor_Nm[j] = 3.0 * std::sin(phase) - 0.5 * sense.velocity[j];
      led_to[j] = sense.position[j] + kReachTick_s * sense.velocity[j];
    }
    guard.step(demand.motor_Nm, sense.position, sense.velocity, 1.0, kReachTick_s);
    deaf.step(demand.motor_Nm, sense.position, sense.velocity, 1.0, kReachTick_s);
    if (i == 30'000 - 1) break;  // of the last tick's torque, nobody has the energy yet
    lead.render(demand, axes, kReachTick_s);
    balance.capped += (lead.hand().wrench(demand.motor_Nm) - lead.wrench()).norm() > 1e-9;
    const double taken_J = -lead.wrench().dot(displacement(handle.pose, next));
    balance.at_hand += taken_J;
    balance.exchanged += std::abs(taken_J);
    lead.advance(demand, kReachTick_s);
    handle.pose = next;
  }
  for (std::size_t j = 0; j < arm.joint_count(); ++j) {
    balance.of_guard += guard.energy_J(j);
    balance.without_share += deaf.energy_J(j);
  }
  return balance;
}

CartesianConfig weak_hand() {
  CartesianConfig config =
      load_config(kHapticSite, hot_cell().file, shipped_arm().arm, shipped_arm().home, {}).cartesian.value();
  config.wrench.force_cap_N = 2.0;
  config.wrench.moment_cap_N_m = 0.3;
  return config;
}

TEST(CartesianLead, SR13_TheGuardsBalanceIsTheEnergyThatACappedHandRenders) {
  const CartesianConfig slow = weak_hand();
  CartesianConfig fast = slow;
  fast.wrench.force_rate_N_per_s = fast.wrench.moment_rate_Nm_per_s = 1e9;
  double wrong_without_J = 0.0;
  for (const std::uint32_t seed : {1U, 2U, 3U, 4U, 5U}) {
    SCOPED_TRACE(seed);
    const Balance capped = balance_of(fast, messages::kAllAxes, seed);
    EXPECT_GT(capped.capped, 9000);
    EXPECT_NEAR(capped.of_guard, capped.at_hand, 1e-6 * capped.exchanged);
    wrong_without_J += std::abs(capped.without_share - capped.at_hand);
    // A wrench that lags may brake where the torques push, which a share cannot say: less counts as taken.
    const Balance slewed = balance_of(slow, messages::kAllAxes, seed);
    EXPECT_NEAR(slewed.of_guard, slewed.at_hand, 1e-3 * slewed.exchanged);
    EXPECT_LE(slewed.of_guard, slewed.at_hand + 1e-6 * slewed.exchanged);
  }
  EXPECT_GT(wrong_without_J, 10.0) << "the caps matter";
}

TEST(CartesianLead, SR13_OnADeviceWithoutMomentsTheBalanceIsNeverMoreThanItTook) {
  for (const std::uint32_t seed : {1U, 2U, 3U}) {
    const Balance balance = balance_of(weak_hand(), 7U, seed);
    EXPECT_LE(balance.of_guard, balance.at_hand + 1e-6 * balance.exchanged) << seed;
  }
}

}  // namespace
}  // namespace phantom::master_io

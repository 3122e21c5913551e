// The thesis's joystick leads a Cartesian robot that has more joints than it: with two axes, with one, and
// with drives on CAN. Drag of the led joints comes back to it, and nothing of the others.
#include <gtest/gtest.h>

#include <cmath>
#include <iostream>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>

#include "common/dds/endpoints/endpoint.hpp"
#include "tests/end_to_end/running_system.hpp"

namespace phantom::end_to_end {
namespace {

constexpr std::size_t kX = 0, kY = 1, kJoints = 5;  // of the robot; x, y, z, theta, phi

class JoystickSystem : public testing::Test {
 protected:
  void run(const std::string& topology) {
    system_.emplace(0.0, topology);
    participant_.emplace("joystick_test", system_->network());
    masters_.emplace(*participant_, dds::kMasterState,
                     [this](const msg::MasterState& m, const dds::SampleInfo&) { on_master(m); });
    slaves_.emplace(*participant_, dds::kSlaveState,
                    [this](const msg::SlaveState& s, const dds::SampleInfo&) { on_slave(s); });
  }
  void on_master(const msg::MasterState& m) {
    const std::lock_guard lock(mutex_);
    master_ = m;
    if (m.state() != msg::LinkState::LINK_COUPLED) return;
    for (std::size_t j = 0; j < kJoints; ++j) {
      const double torque = m.percept_torque_Nm()[j] + m.feedback_torque_Nm()[j];
      greatest_torque_[j] = std::max(greatest_torque_[j], std::abs(torque));
      greatest_power_W_ = std::max(greatest_power_W_, m.percept_torque_Nm()[j] * m.velocity_rad_s()[j]);
    }
  }
  void on_slave(const msg::SlaveState& s) {
    const std::lock_guard lock(mutex_);
    if (s.state() != msg::LinkState::LINK_COUPLED) return;
    if (!start_) start_ = s;
    for (std::size_t j = 0; j < kJoints; ++j)
      moved_[j] = std::max(moved_[j], std::abs(s.position_rad()[j] - start_->position_rad()[j]));
    if (master_)
      behind_m_ = std::max(behind_m_, std::abs(s.position_rad()[kX] - master_->position_rad()[kX]));
  }
  bool until(auto condition, double limit_s = 90.0) {
    return eventually(
        [&] {
          const std::lock_guard lock(mutex_);
          return condition();
        },
        limit_s);
  }
  /// What every such session owes; ends it.
  void expect_joystick(const std::vector<std::size_t>& led) {
    const auto ready = [&] {
      return system_->output().find("All components are ready") != std::string::npos;
    };
    EXPECT_TRUE(eventually(ready, 60.0)) << "a viewer that still starts does not end in time on a busy host";
    system_->stop();
    EXPECT_EQ(system_->wait(), 0);
    const std::lock_guard lock(mutex_);
    EXPECT_LE(greatest_power_W_, 0.0) << "drag takes energy, always";
    EXPECT_LT(behind_m_, 0.05) << "the robot follows";
    for (std::size_t j = 0; j < kJoints; ++j) {
      if (std::find(led.begin(), led.end(), j) != led.end()) continue;
      EXPECT_EQ(greatest_torque_[j], 0.0) << "joint " << j << " is not the joystick's";
      EXPECT_LT(moved_[j], 0.005) << "joint " << j << " stands still";
    }
  }
  nlohmann::json mapping() const {
    return nlohmann::json::parse(read_text(system_->report() / "master_io.json"))["joint_mapping"];
  }
  /// Torque within the motor's and force at 75 mm of it, which took energy from the hand.
  static void expect_axis(const nlohmann::json& axis, const char* name, const char* leads, double limit_Nm) {
    EXPECT_EQ(axis["master"], name);
    EXPECT_EQ(axis["leads"], leads);
    const double torque_Nm = axis["greatest_torque_Nm"];
    std::cout << name << ": " << torque_Nm << " N·m, " << axis["energy_from_hand_J"] << " J\n";
    EXPECT_GT(torque_Nm, 0.02);
    EXPECT_LE(torque_Nm, limit_Nm);
    EXPECT_NEAR(axis["greatest_hand_force_N"], torque_Nm / 0.075, 1e-6);
    EXPECT_GT(axis["energy_from_hand_J"], 0.0);
  }
  void TearDown() override {
    if (HasFailure()) std::cerr << system_->output() << read_text(system_->report() / "logs/master_io.log");
  }

  std::mutex mutex_;
  std::optional<RunningSystem> system_;
  std::optional<msg::MasterState> master_;
  std::optional<msg::SlaveState> start_;
  std::array<double, kJoints> greatest_torque_{}, moved_{};
  double greatest_power_W_ = -1e9, behind_m_ = 0.0;
  std::optional<dds::Participant> participant_;
  std::optional<dds::Reader<msg::MasterState>> masters_;
  std::optional<dds::Reader<msg::SlaveState>> slaves_;
};

TEST_F(JoystickSystem, TwoAxesLeadXAndY) {
  run("joystick");
  EXPECT_TRUE(until([&] { return moved_[kX] > 0.25 && moved_[kY] > 0.25; })) << "a reach along each";
  expect_joystick({kX, kY});
  const auto axes = mapping();
  ASSERT_EQ(axes.size(), 2U);
  expect_axis(axes[0], "theta", "x", 0.32);
  expect_axis(axes[1], "phi", "y", 1.27);
}

TEST_F(JoystickSystem, OneAxisLeadsX) {
  run("joystick_one_axis");
  EXPECT_TRUE(until([&] { return moved_[kX] > 0.25; }));
  expect_joystick({kX});
  const auto axes = mapping();
  ASSERT_EQ(axes.size(), 1U);
  expect_axis(axes[0], "theta", "x", 0.32);
}

TEST_F(JoystickSystem, OnDrivesAHandLeadsXAndY) {
  const auto is_led = [&] {
    return moved_[kX] > 0.1 && moved_[kY] > 0.1 && greatest_torque_[kX] > 0.05 && greatest_torque_[kY] > 0.05;
  };
  run("joystick_can");
  // A busy host parts the robot from the hand, which comes by where the robot stands twice in 12 s.
  EXPECT_TRUE(until(is_led)) << "the robot follows the hand, which feels it";
  expect_joystick({kX, kY});
  const auto axes = mapping();
  ASSERT_EQ(axes.size(), 2U);
  EXPECT_GT(axes[0]["energy_from_hand_J"], 0.0);
  EXPECT_GT(axes[1]["energy_from_hand_J"], 0.0);
}

}  // namespace
}  // namespace phantom::end_to_end

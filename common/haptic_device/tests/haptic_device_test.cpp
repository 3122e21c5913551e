#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <mutex>
#include <optional>
#include <thread>

#include "common/dds/endpoints/endpoint.hpp"
#include "common/dds/endpoints/stamp.hpp"
#include "common/haptic_device/phantom_haptic_device.h"
#include "common/messages/codecs/haptic_device_codec.hpp"
#include "common/runtime/configuration/deployment.hpp"
#include "tests/support/eventually.hpp"
#include "tests/support/heap_guard.hpp"
#include "tests/support/own_domain.hpp"

extern "C" int sends_from_c(phantom_haptic_device* device);

namespace phantom {
namespace {

using testing::HasSubstr;
constexpr phantom_haptic_abilities kAble{63, 7, 12.0, 0.5, 0.3, 0.01, 0.08, 1.1, 0.001};
constexpr phantom_haptic_state kAtRest{{0.01, 0.02, 0.03}, {0, 0, 0, 1}, {0, 0, 0}, {0, 0, 0}, 1, 1, 5, -1.0};

std::string topology() { return PHANTOM_SOURCE_DIR "/deploy/topologies/single_host.yaml"; }

/// A device by the C interface, and a master that speaks to it by topic.
class HapticDeviceLibrary : public testing::Test {
 protected:
  HapticDeviceLibrary()
      : participant_("master_io", network()),
        stamper_(participant_),
        wrenches_(participant_, dds::kHapticDeviceWrench) {
    states_.emplace(participant_, dds::kHapticDevice,
                    [this](const msg::HapticDevice& m, const dds::SampleInfo&) {
                      const std::lock_guard lock(mutex_);
                      state_ = m;
                      ++count_;
                    });
    std::string domain = std::to_string(domain_), file = topology();
    std::array<std::string, 5> words{"device", "--deployment", file, "--domain", domain};
    std::array<char*, 5> argv{};
    for (std::size_t i = 0; i < words.size(); ++i) argv[i] = words[i].data();
    char why[200] = "";
    device_ = phantom_haptic_device_open(static_cast<int>(argv.size()), argv.data(), &kAble, why, sizeof why);
    EXPECT_NE(device_, nullptr) << why;
  }
  ~HapticDeviceLibrary() override { phantom_haptic_device_close(device_); }

  core::NetworkOptions network() {
    runtime::ProcessOptions options;
    options.deployment = topology();
    options.domain = domain_ = test::own_domain();
    return runtime::load_deployment(options).network;
  }
  void send_wrench(double force_N, bool valid = true) {
    msg::HapticDeviceWrench wrench;
    wrench.stamp(stamper_.next());
    wrench.force_N().x(force_N);
    wrench.moment_N_m().z(0.25 * force_N);
    wrench.valid(valid);
    wrench.leads(valid);
    wrench.time_to_live_s(0.1);
    wrench.fade_s(0.1);
    {
      const std::lock_guard lock(mutex_);
      if (state_) wrench.device_echo(dds::echo_of(dds::id_of(state_->stamp())));
      if (follows_another_) wrench.device_echo().session(wrench.device_echo().session() + 1);
    }
    sent_ = dds::id_of(wrench.stamp());
    wrenches_.write(wrench);
  }
  phantom_haptic_wrench receive() {
    phantom_haptic_wrench wrench;
    phantom_haptic_device_receive(device_, &wrench);
    return wrench;
  }
  bool meets() {
    return test::eventually([&] {
      phantom_haptic_device_send(device_, &kAtRest);
      send_wrench(1.0);
      const std::lock_guard lock(mutex_);
      return state_.has_value() && receive().valid == 1;
    });
  }

  int domain_ = 0;
  dds::Participant participant_;
  dds::Stamper stamper_;
  dds::Writer<msg::HapticDeviceWrench> wrenches_;
  std::mutex mutex_;
  std::optional<msg::HapticDevice> state_;
  int count_ = 0;
  bool follows_another_ = false;
  core::SampleId sent_;
  std::optional<dds::Reader<msg::HapticDevice>> states_;
  phantom_haptic_device* device_ = nullptr;
};

TEST_F(HapticDeviceLibrary, SendsWhatTheHandDoesAndWhatTheDeviceIsAbleTo) {
  ASSERT_TRUE(meets());
  const std::lock_guard lock(mutex_);
  EXPECT_EQ(state_->X_DH().position_m().y(), 0.02);
  EXPECT_EQ(state_->X_DH().qw(), 1.0);
  EXPECT_TRUE(state_->ready() && state_->clutch());
  EXPECT_EQ(state_->buttons(), 5U);
  EXPECT_EQ(state_->grip_opening(), -1.0);
  EXPECT_EQ(state_->measured_axes(), 63U);
  EXPECT_EQ(state_->actuated_axes(), 7U);
  EXPECT_EQ(state_->max_force_N(), 12.0);
  EXPECT_EQ(state_->mass_kg(), 0.3);
  EXPECT_EQ(state_->workspace_m(), 0.08);
  EXPECT_EQ(state_->period_s(), 0.001);
}

TEST_F(HapticDeviceLibrary, AStateEchoesTheWrenchThatWasReceivedBeforeIt) {
  ASSERT_TRUE(meets());
  send_wrench(2.0);
  ASSERT_TRUE(test::eventually([&] { return receive().force_N[0] == 2.0; }));
  ASSERT_EQ(sends_from_c(device_), 0);
  EXPECT_TRUE(test::eventually([&] {
    const std::lock_guard lock(mutex_);
    return dds::id_of(state_->wrench_echo()) == sent_;
  }));
  const phantom_haptic_wrench wrench = receive();
  EXPECT_EQ(wrench.moment_N_m[2], 0.5);
  EXPECT_GT(wrench.answer_s, 0.0);
  EXPECT_LT(wrench.answer_s, 30.0);
}

TEST_F(HapticDeviceLibrary, AWrenchThatIsNotRenewedFadesToNothingInItsTime) {
  ASSERT_TRUE(meets());
  send_wrench(10.0);
  ASSERT_TRUE(test::eventually([&] { return receive().force_N[0] == 10.0; }));
  double last_N = 10.0;
  bool between = false;
  for (;;) {
    const phantom_haptic_wrench wrench = receive();
    EXPECT_LE(wrench.force_N[0], last_N) << "it only falls";
    last_N = wrench.force_N[0];
    between = between || (last_N > 0.0 && last_N < 10.0);
    EXPECT_TRUE(wrench.age_s <= 0.1 || wrench.valid == 0);
    EXPECT_TRUE(wrench.age_s <= 0.2 || last_N == 0.0);
    if (wrench.age_s > 0.3) break;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  EXPECT_TRUE(between) << "it fades, it does not drop";
}

TEST_F(HapticDeviceLibrary, AWrenchThatIsNoLongerValidFadesToo) {
  ASSERT_TRUE(meets());
  send_wrench(10.0);
  ASSERT_TRUE(test::eventually([&] { return receive().force_N[0] == 10.0; }));
  bool between = false;
  EXPECT_TRUE(test::eventually([&] {
    send_wrench(0.0, false);
    const phantom_haptic_wrench wrench = receive();
    between = between || (wrench.force_N[0] > 0.0 && wrench.force_N[0] < 10.0);
    return wrench.force_N[0] == 0.0 && wrench.valid == 0;
  }));
  EXPECT_TRUE(between);
}

TEST_F(HapticDeviceLibrary, AWrenchForAnotherDeviceIsNotExerted) {
  ASSERT_TRUE(meets());
  send_wrench(10.0);
  ASSERT_TRUE(test::eventually([&] { return receive().force_N[0] == 10.0; }));
  follows_another_ = true;
  EXPECT_TRUE(test::eventually([&] {
    send_wrench(10.0);
    const phantom_haptic_wrench wrench = receive();
    return wrench.force_N[0] == 0.0 && wrench.valid == 0 && wrench.leads == 0;
  }));
}

TEST_F(HapticDeviceLibrary, AStateThatCannotBeIsRefusedAndNotSent) {
  ASSERT_TRUE(meets());
  phantom_haptic_state bad = kAtRest;
  bad.velocity_m_s[1] = std::nan("");
  EXPECT_EQ(phantom_haptic_device_send(device_, &bad), 1);
  EXPECT_THAT(phantom_haptic_device_why(device_), HasSubstr("velocity_m_s is not finite"));
  bad = kAtRest;
  bad.orientation_xyzw[3] = 0.5;
  EXPECT_EQ(phantom_haptic_device_send(device_, &bad), 1);
  EXPECT_THAT(phantom_haptic_device_why(device_), HasSubstr("quaternion"));
  EXPECT_EQ(phantom_haptic_device_send(device_, &kAtRest), 0);
  EXPECT_STREQ(phantom_haptic_device_why(device_), "");
}

TEST_F(HapticDeviceLibrary, TheDevicesOwnLoopAllocatesNothing) {
  ASSERT_TRUE(meets());
  const test::HeapGuard guard;
  for (int i = 0; i < 100; ++i) {
    phantom_haptic_wrench wrench;
    phantom_haptic_device_receive(device_, &wrench);
    ASSERT_EQ(phantom_haptic_device_send(device_, &kAtRest), 0);
  }
}

TEST(HapticDeviceOpen, SaysWhyItCannot) {
  char why[40];
  std::string option = "--deployment", file = "/nowhere.yaml";
  char* argv[] = {option.data(), file.data()};
  EXPECT_EQ(phantom_haptic_device_open(2, argv, &kAble, why, sizeof why), nullptr);
  EXPECT_THAT(why, HasSubstr("/nowhere.yaml"));
  option = "--domain", file = "12x";
  EXPECT_EQ(phantom_haptic_device_open(2, argv, &kAble, why, sizeof why), nullptr);
  EXPECT_THAT(why, HasSubstr("--domain 12x"));
  phantom_haptic_device_close(nullptr);
}

}  // namespace
}  // namespace phantom

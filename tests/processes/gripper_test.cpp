// The shipped example of a gripper, by real processes: a person at a shell, or the grip of a haptic device,
// closes it on an object, and it holds that whatever becomes of the master.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <csignal>
#include <fstream>
#include <memory>
#include <mutex>

#include "common/dds/endpoints/endpoint.hpp"
#include "common/dds/endpoints/topics.hpp"
#include "common/haptic_device/handle_service.hpp"
#include "common/messages/codecs/teleoperation_codec.hpp"
#include "tests/processes/running_process.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/eventually.hpp"
#include "tests/support/files.hpp"
#include "tests/support/own_domain.hpp"

namespace phantom::processes {
namespace {

using teleop::LinkState;
using test::eventually;
using testing::HasSubstr;

class GripperExample : public testing::Test {
 protected:
  GripperExample() {
    const std::string source = PHANTOM_SOURCE_DIR "/deploy/";
    std::ofstream(topology_) << test::all_replaced(test::text_of(source + "topologies/gripper.yaml"), "../",
                                                   source);
  }
  std::vector<std::string> where() const {
    return {"--deployment", topology_.string(), "--domain", std::to_string(domain_)};
  }
  std::unique_ptr<RunningProcess> start(const std::string& name) {
    return std::make_unique<RunningProcess>(name, RunningProcess::Options{.arguments = where()}, folder_);
  }
  /// A person at a shell.
  test::Said command(const std::string& words) const {
    return test::run_line(PHANTOM_BIN_DIR "/slave_io command " + words + " --timeout-s 20 --deployment " +
                          topology_.string() + " --domain " + std::to_string(domain_));
  }
  messages::GripperState gripper() {
    const std::lock_guard lock(mutex_);
    return gripper_;
  }
  LinkState arm() {
    const std::lock_guard lock(mutex_);
    return arm_;
  }

  const int domain_ = test::own_domain();
  const std::filesystem::path folder_ = test::new_folder(), topology_ = folder_ / "topology.yaml";
  std::mutex mutex_;
  messages::GripperState gripper_;
  LinkState arm_ = LinkState::kInit;
  dds::Participant observer_{"observer",
                             {.domain = domain_,
                              .qos_profiles = PHANTOM_SOURCE_DIR "/deploy/qos/phantom.xml",
                              .interfaces = {"127.0.0.1"}}};
  dds::Reader<msg::GripperState> grippers_{observer_, dds::kGripperState,
                                           [this](const msg::GripperState& message, const dds::SampleInfo&) {
                                             const auto state = messages::from_idl(message);
                                             const std::lock_guard lock(mutex_);
                                             if (state) gripper_ = *state;
                                             return static_cast<bool>(state);
                                           }};
  dds::Reader<msg::SlaveState> arms_{observer_, dds::kSlaveState,
                                     [this](const msg::SlaveState& message, const dds::SampleInfo&) {
                                       const auto state = messages::from_idl(message);
                                       const std::lock_guard lock(mutex_);
                                       if (state) arm_ = state->state;
                                       return static_cast<bool>(state);
                                     }};
};

TEST_F(GripperExample, APersonAtAShellClosesItAndItHoldsWhateverBecomesOfTheMaster) {
  const auto slave = start("slave_io");
  auto master = start("master_io");
  ASSERT_TRUE(eventually([&] { return gripper().open && arm() == LinkState::kCoupled; }, 120.0))
      << slave->log();

  const test::Said refused = command("gripper close --force-N 1000");
  EXPECT_EQ(refused.exit_code, 1) << refused.output;
  EXPECT_THAT(refused.output, HasSubstr("force is 1000; allowed: 3 to 40 N"));
  EXPECT_TRUE(gripper().open) << "a force that is refused closes nothing";

  const test::Said closed = command("gripper close --force-N 25");
  ASSERT_EQ(closed.exit_code, 0) << closed.output;
  EXPECT_THAT(closed.output, HasSubstr("slave_io: done"));
  ASSERT_TRUE(eventually([&] { return gripper().holds; }, 60.0));
  EXPECT_NEAR(gripper().sense.width_m, 0.042, 0.002);
  EXPECT_NEAR(gripper().sense.force_N, 25.0, 0.5);
  EXPECT_EQ(gripper().requested_force_N, 25.0);

  master->end(SIGKILL);
  ASSERT_TRUE(eventually([&] { return arm() == LinkState::kDegraded; }, 60.0));
  EXPECT_TRUE(gripper().holds);
  EXPECT_NEAR(gripper().sense.force_N, 25.0, 0.5);

  ASSERT_EQ(command("gripper width 60").exit_code, 0);
  EXPECT_TRUE(
      eventually([&] { return std::abs(gripper().sense.width_m - 0.06) < 1e-3 && !gripper().moves; }, 60.0));
  EXPECT_FALSE(gripper().holds);
}

/// A haptic device that the hand holds still, and whose grip it opens and closes.
class GripOfADevice : public GripperExample {
 protected:
  GripOfADevice() {
    const std::string wrist =
        "  joints:                              # of the wrist\n    j5_roll: {inertia: 0.004}\n"
        "    j6_wrist: {inertia: 0.004}\n    j7_tool_roll: {inertia: 0.002}\n";
    std::ofstream(folder_ / "master_io.yaml") << test::all_replaced(
        test::text_of(PHANTOM_SOURCE_DIR "/deploy/cartesian/hot_cell_headset.yaml"), wrist, "");
    const std::string text = test::text_of(topology_);
    std::ofstream(topology_) << test::all_replaced(
        text, "{component: master_io, simulation: true}",
        "{component: master_io, config: " + (folder_ / "master_io.yaml").string() + "}");
  }
  void move_grip(double to) {
    for (const double step = to > grip ? 0.02 : -0.02; std::abs(to - grip) > 0.02; grip = grip + step)
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    grip = to;
  }
  /// Closes the grip and opens it so far, again and again until something holds: where the machine is busy, a
  /// closed grip may go unseen, and the hand does it again.
  template <class Predicate>
  bool pull_until(double then, Predicate holds) {
    return eventually(
        [&] {
          move_grip(0.0);
          move_grip(then);
          return eventually(holds, 5.0);
        },
        60.0);
  }

  std::atomic<double> grip{1.0};
  dds::Participant hand_{"haptic_device",
                         {.domain = domain_,
                          .qos_profiles = PHANTOM_SOURCE_DIR "/deploy/qos/phantom.xml",
                          .interfaces = {"127.0.0.1"}}};
  haptic_device::HandleService device_{hand_,
                                       {},
                                       [this](const auto&, const auto&, double, core::Nanoseconds) {
                                         return haptic_device::HandleService::Handle{{.valid = true}, grip};
                                       },
                                       [](const std::string& why) { ADD_FAILURE() << why; }};
};

TEST_F(GripOfADevice, LeadsTheGripperOnceItHasComeToItsWidth) {
  const auto slave = start("slave_io");
  auto master = start("master_io");
  const auto rests_at = [&](double width_m) {
    return [&, width_m] { return std::abs(gripper().sense.width_m - width_m) < 0.002 && !gripper().moves; };
  };
  ASSERT_TRUE(eventually([&] { return gripper().open && arm() == LinkState::kCoupled; }, 120.0))
      << slave->log() << master->log();
  move_grip(0.7);  // both were open
  EXPECT_TRUE(eventually(rests_at(0.7 * gripper().widest_m), 60.0)) << gripper().sense.width_m;

  // A width that the grip asked for may be on its way still: the person closes it again then.
  ASSERT_TRUE(eventually(
      [&] {
        if (gripper().requested_width_m > 0.0) {
          EXPECT_EQ(command("gripper close --force-N 25").exit_code, 0);
        }
        return eventually([&] { return gripper().holds; }, 5.0);
      },
      60.0));
  move_grip(1.0);
  std::this_thread::sleep_for(std::chrono::milliseconds(500));
  EXPECT_TRUE(gripper().holds) << "the grip is not where the fingers are";
  EXPECT_EQ(gripper().requested_width_m, 0.0);

  EXPECT_TRUE(pull_until(0.6, rests_at(0.6 * gripper().widest_m))) << gripper().sense.width_m;
  EXPECT_FALSE(gripper().holds);
  move_grip(0.0);
  ASSERT_TRUE(eventually([&] { return gripper().holds && gripper().requested_width_m == 0.0; }, 60.0))
      << "closed on the object by the grip";
  EXPECT_NEAR(gripper().sense.width_m, 0.042, 0.002);

  // A new master finds a grip that was opened meanwhile.
  master->end(SIGKILL);
  ASSERT_TRUE(eventually([&] { return arm() == LinkState::kDegraded; }, 60.0));
  grip = 1.0;
  master = start("master_io");
  ASSERT_TRUE(eventually([&] { return arm() == LinkState::kCoupled; }, 60.0)) << master->log();
  std::this_thread::sleep_for(std::chrono::milliseconds(500));
  EXPECT_TRUE(gripper().holds);
  EXPECT_EQ(gripper().requested_width_m, 0.0);
  EXPECT_TRUE(pull_until(1.0, [&] { return gripper().open; })) << "pulled whole and let go, it opens";
}

}  // namespace
}  // namespace phantom::processes

// A master of ROS 2 leads the demo's arm through ros2_gateway, master_io and slave_io: a node of another
// vendor's DDS that publishes TwistStamped.
#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <cmath>
#include <fstream>
#include <mutex>
#include <optional>
#include <thread>

#include "common/core/clock.hpp"
#include "common/dds/endpoints/endpoint.hpp"
#include "tests/end_to_end/running_system.hpp"
#include "tests/ros2/foreign_node.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/own_domain.hpp"

namespace phantom::ros2 {
namespace {

using end_to_end::RunningSystem;
using phantom::test::eventually;

/// A person at a stick: publishes at 50 Hz what is commanded, or nothing.
class Stick {
 public:
  explicit Stick(int domain)
      : node_(domain, test::Distribution::kSinceIron), thread_([this](const std::stop_token& stop) {
          while (!stop.stop_requested()) {
            if (publishes) node_.publish_twist("base_link", {x_m_s, 0.0, z_m_s}, {});
            std::this_thread::sleep_for(std::chrono::milliseconds(20));
          }
        }) {}
  std::atomic<double> x_m_s{0.0}, z_m_s{0.0};
  std::atomic<bool> publishes{true};

 private:
  test::ForeignNode node_;
  std::jthread thread_;
};

TEST(Ros2Master, LeadsTheArmAndLetsGoOfItInItsSilence) {
  const int ros_domain = phantom::test::own_domain(1);
  RunningSystem system(0.0, "ros2_master", "ros2_gateway");
  std::ofstream(system.folder() / "gateway.yaml") << phantom::test::replaced(
      phantom::test::read_text(PHANTOM_SOURCE_DIR "/deploy/cartesian/ros2_master_gateway.yaml"),
      "interfaces:", "domain: " + std::to_string(ros_domain) + "\ninterfaces:");
  auto gateway = std::make_unique<phantom::test::Process>(
      std::vector<std::string>{PHANTOM_BIN_DIR "/ros2_gateway", "--deployment",
                               (system.folder() / "topology.yaml").string(), "--domain",
                               std::to_string(system.network().domain), "--config",
                               (system.folder() / "gateway.yaml").string()},
      system.folder() / "gateway.log");
  dds::Participant observer("ros2_master_test", system.network());
  std::mutex mutex;
  std::optional<msg::SlaveState> slave;
  dds::Reader<msg::SlaveState> states(observer, dds::kSlaveState,
                                      [&](const msg::SlaveState& state, const dds::SampleInfo&) {
                                        const std::lock_guard lock(mutex);
                                        slave = state;
                                      });
  std::atomic<bool> valid{false}, leads{false};
  dds::Reader<msg::HapticDeviceWrench> wrenches(
      observer, dds::kHapticDeviceWrench, [&](const msg::HapticDeviceWrench& wrench, const dds::SampleInfo&) {
        valid = wrench.valid();
        leads = wrench.leads();
      });
  const auto pose = [&] {
    const std::lock_guard lock(mutex);
    std::vector<double> q;
    if (slave) q.assign(slave->position_rad().begin(), slave->position_rad().begin() + slave->joint_count());
    return q;
  };
  const auto speed = [&] {
    const std::lock_guard lock(mutex);
    return slave ? slave->tool_speed_m_s() : 0.0;
  };
  const auto moved = [](const std::vector<double>& a, const std::vector<double>& b) {
    double most = 0.0;
    for (std::size_t j = 0; j < a.size(); ++j) most = std::max(most, std::abs(a[j] - b[j]));
    return most;
  };
  Stick stick(ros_domain);
  ASSERT_TRUE(eventually([&] { return leads.load(); }, 240.0))
      << system.output() << phantom::test::read_text(system.folder() / "gateway.log");
  const std::vector<double> before = pose();
  ASSERT_FALSE(before.empty());
  EXPECT_LT(speed(), 0.02) << "at rest";
  // Where the machine is busy, a gap in the commands may let go of the arm: the person begins again, at rest.
  const auto lead = [&](double z_m_s, const std::vector<double>& from) {
    return eventually([&] {
      stick.z_m_s = leads ? z_m_s : 0.0;
      return moved(from, pose()) > 0.02;
    });
  };
  EXPECT_TRUE(lead(0.05, before));
  // Twice as fast as the handle, by the site's scale, unless drag or a limit slows it down.
  EXPECT_LT(speed(), 0.25);
  stick.z_m_s = 0.05;
  stick.publishes = false;
  EXPECT_TRUE(eventually([&] { return !leads && speed() < 0.005; }, 10.0));
  const std::vector<double> held = pose();
  stick.publishes = true;  // the same command: it was not seen at rest
  std::this_thread::sleep_for(std::chrono::seconds(2));
  EXPECT_FALSE(leads);
  EXPECT_LT(moved(held, pose()), 0.01);
  stick.z_m_s = 0.0;
  EXPECT_TRUE(eventually([&] { return leads.load(); }, 30.0));
  EXPECT_TRUE(lead(-0.05, held));
  // The process dies: the arm holds.
  gateway->signal(SIGKILL);
  EXPECT_TRUE(eventually([&] { return !valid && speed() < 0.005; }, 10.0));
}

}  // namespace
}  // namespace phantom::ros2

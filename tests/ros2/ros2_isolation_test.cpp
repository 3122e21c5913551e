// The servo loops beside a ROS 2 side that floods, sends nonsense, blocks and dies: as even as an empty loop
// on the same host, and as in peace. The ROS 2 side is another process with nodes of another vendor's DDS.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <map>
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

constexpr double kPhase_s = 10.0;

/// A cloud as a depth camera sends it.
test::Cloud large_cloud() {
  test::Cloud cloud{.frame = "lidar",
                    .stamp_ns = core::utc_ns(),
                    .height = 1,
                    .width = 50'000,
                    .point_step = 12,
                    .row_step = 600'000,
                    .fields = {{"x", 0, 7, 1}, {"y", 4, 7, 1}, {"z", 8, 7, 1}},
                    .data = std::vector<std::uint8_t>(600'000)};
  return cloud;
}

void flood(test::ForeignNode& node) {
  const test::Cloud cloud = large_cloud();
  for (int k = 0;; ++k) {
    node.publish_twist("base_link", {0.05 * std::sin(1e-4 * k), 0.0, 0.0}, {});
    node.publish_wrench("ft_sensor", {1.0, 2.0, 3.0}, {});
    if (k % 100 == 0) {
      test::Cloud now = cloud;
      now.stamp_ns = core::utc_ns();
      node.publish_cloud(now);
    }
  }
}

void send_nonsense(test::ForeignNode& node) {
  for (int k = 0;; ++k) {
    node.publish_twist(std::string(static_cast<std::size_t>(k % 2000), 'f'), {NAN, INFINITY, 1e300},
                       {NAN, 0, 0});
    node.publish_wrench("", {NAN, NAN, NAN}, {});
    node.publish_joints({"a", "a"}, {NAN}, {1, 2, 3}, -1);
    node.publish_sphere(std::string(500, 's'), k % 9, {NAN, 1e300, 0}, -1.0, "nowhere");
    test::Cloud cloud = large_cloud();
    cloud.data.resize(1000);
    cloud.width = k % 2 == 0 ? 4'000'000'000U : 1U;
    cloud.point_step = k % 3 == 0 ? 4'000'000'000U : 12U;
    cloud.fields.resize(64, {"x", 4'000'000'000U, 255, 4'000'000'000U});
    node.publish_cloud(cloud);
  }
}

/// Subscribes to all that is large and reliable, so that who stands still or dies leaves a writer waiting.
void subscribe(test::ForeignNode& node) {
  for (;;) {
    node.clouds("phantom/workspace/boundary");
    node.marker_arrays("phantom/workspace/meshes");
    node.joints("phantom/joint_states");
    node.transforms("tf");
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
}

// The other process: the test starts itself with this test alone.
TEST(Ros2Side, DISABLED_IsAnotherProcess) {
  const char* domain = std::getenv("PHANTOM_TEST_ROS_DOMAIN");
  const char* what = std::getenv("PHANTOM_TEST_ROS_SIDE");
  ASSERT_TRUE(domain != nullptr && what != nullptr);
  test::ForeignNode node(std::atoi(domain), test::Distribution::kSinceIron);
  if (std::string(what) == "flood") flood(node);
  if (std::string(what) == "nonsense") send_nonsense(node);
  if (std::string(what) == "subscribe") subscribe(node);
}

std::unique_ptr<phantom::test::Process> ros_side(const std::string& what, int domain,
                                                 const std::filesystem::path& folder) {
  setenv("PHANTOM_TEST_ROS_DOMAIN", std::to_string(domain).c_str(), 1);
  setenv("PHANTOM_TEST_ROS_SIDE", what.c_str(), 1);
  return std::make_unique<phantom::test::Process>(
      std::vector<std::string>{"/proc/self/exe", "--gtest_filter=Ros2Side.*",
                               "--gtest_also_run_disabled_tests"},
      folder / (what + ".log"));
}

/// The loops of master_io and slave_io as their status has them, and the gateway's.
class Watch {
 public:
  explicit Watch(const core::NetworkOptions& network)
      : participant_("isolation_test", network),
        reader_(participant_, dds::kComponentStatus,
                [this](const msg::ComponentStatus& status, const dds::SampleInfo& info) {
                  const std::lock_guard lock(mutex_);
                  newest_[status.component_name().c_str()] = status;
                  heard_ns_[status.component_name().c_str()] = info.received_ns;
                }) {}
  std::optional<msg::LoopStatistics> loop(const std::string& component, const std::string& name) {
    const std::lock_guard lock(mutex_);
    const auto found = newest_.find(component);
    if (found == newest_.end()) return std::nullopt;
    for (const auto& loop : found->second.loops())
      if (loop.name() == name.c_str()) return loop;
    return std::nullopt;
  }
  /// Returns a figure of a component; 0: it has none of that name.
  double figure(const std::string& component, const std::string& name) {
    const std::lock_guard lock(mutex_);
    for (const auto& figure : newest_[component].figures())
      if (figure.name() == name.c_str()) return figure.value();
    return 0.0;
  }
  bool answers(const std::string& component) {
    const std::lock_guard lock(mutex_);
    return core::monotonic_ns() - heard_ns_[component] < 3 * core::kNsPerSecond;
  }

 private:
  std::mutex mutex_;
  std::map<std::string, msg::ComponentStatus> newest_;
  std::map<std::string, core::Nanoseconds> heard_ns_;
  dds::Participant participant_;
  dds::Reader<msg::ComponentStatus> reader_;
};

/// The share of periods that a loop skipped, and how late it woke at worst (99 %) in the last second.
struct Evenness {
  double servo = 0.0, bare = 0.0, servo_p99_us = 0.0, bare_p99_us = 0.0;
};

class Isolation : public testing::Test {
 protected:
  Evenness during(const char* phase) {
    const auto servo = watch_.loop("master_io", "servo"), bare = watch_.loop("master_io", "bare_loop");
    EXPECT_TRUE(servo && bare);
    if (!servo || !bare) return {};
    std::this_thread::sleep_for(std::chrono::duration<double>(kPhase_s));
    const auto servo_after = watch_.loop("master_io", "servo"),
               bare_after = watch_.loop("master_io", "bare_loop");
    const auto share = [](const msg::LoopStatistics& from, const msg::LoopStatistics& to) {
      const double ticks = static_cast<double>(to.ticks() - from.ticks()),
                   slips = static_cast<double>(to.slips() - from.slips());
      EXPECT_GT(ticks, 100.0);
      return slips / (ticks + slips);
    };
    const Evenness found{share(*servo, *servo_after), share(*bare, *bare_after), servo_after->wakeup_p99_us(),
                         bare_after->wakeup_p99_us()};
    std::printf("%-28s servo skips %.4f (p99 %.0f us late), bare loop %.4f (p99 %.0f us)\n", phase,
                found.servo, found.servo_p99_us, found.bare, found.bare_p99_us);
    return found;
  }
  void expect_as_even(const char* phase, const Evenness& peace) {
    const Evenness found = during(phase);
    EXPECT_LE(found.servo, 1.5 * std::max(peace.servo, found.bare) + 0.05) << phase;
  }
  std::unique_ptr<phantom::test::Process> gateway() {
    const std::string config = phantom::test::replaced(
        phantom::test::read_text(PHANTOM_SOURCE_DIR "/deploy/cartesian/ros2_master_gateway.yaml"),
        "interfaces:",
        "domain: " + std::to_string(ros_domain_) +
            "\nwrench: {topic: wrench}\npoints: {cloud_topic: cloud}\ninterfaces:");
    std::ofstream(system_.folder() / "gateway.yaml") << config;
    return std::make_unique<phantom::test::Process>(
        std::vector<std::string>{PHANTOM_BIN_DIR "/ros2_gateway", "--deployment",
                                 (system_.folder() / "topology.yaml").string(), "--domain",
                                 std::to_string(system_.network().domain), "--config",
                                 (system_.folder() / "gateway.yaml").string()},
        system_.folder() / "gateway.log");
  }

  int ros_domain_ = phantom::test::own_domain(1);
  RunningSystem system_{0.0, "ros2_master", "ros2_gateway"};
  Watch watch_{system_.network()};
};

// Tries ros2_gateway: a ROS 2 side that blocks, floods, dies or sends nonsense
TEST_F(Isolation, TheServoIsAsEvenAsTheBareLoopWhateverTheRos2SideDoes) {
  auto gateway = this->gateway();
  ASSERT_TRUE(eventually(
      [&] { return watch_.loop("master_io", "bare_loop") && watch_.answers("ros2_gateway"); }, 180.0))
      << system_.output();
  const Evenness peace = during("in peace");
  {
    const auto side = ros_side("flood", ros_domain_, system_.folder());
    expect_as_even("it floods", peace);
    EXPECT_GT(watch_.figure("ros2_gateway", "commands"), 1000.0) << "the flood has come";
    EXPECT_GT(watch_.figure("ros2_gateway", "sensor points"), 0.0);
  }
  {
    const auto side = ros_side("nonsense", ros_domain_, system_.folder());
    expect_as_even("it sends nonsense", peace);
    EXPECT_GT(watch_.figure("ros2_gateway", "commands refused"), 1000.0);
  }
  EXPECT_TRUE(eventually([&] { return watch_.answers("ros2_gateway"); }, 30.0)) << "the gateway goes on";
  {
    const auto side = ros_side("subscribe", ros_domain_, system_.folder());
    std::this_thread::sleep_for(std::chrono::seconds(5));
    side->signal(SIGSTOP);
    expect_as_even("it blocks", peace);
    side->signal(SIGKILL);
    expect_as_even("it dies", peace);
  }
  gateway->signal(SIGKILL);
  expect_as_even("the gateway itself dies", peace);
}

}  // namespace
}  // namespace phantom::ros2

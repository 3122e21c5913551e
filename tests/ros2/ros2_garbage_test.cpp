// Garbage on every topic that ros2_gateway hears in its ROS 2 domain, while a robot goes on: nothing dies,
// memory stays bounded, and what is sound is taken at once afterwards. PHANTOM_GARBAGE_S: how long (20 s).
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <mutex>
#include <thread>

#include "common/core/clock.hpp"
#include "common/dds/endpoints/endpoint.hpp"
#include "common/observation/observer.hpp"
#include "common/observation/payload_writer.hpp"
#include "common/ros2/introspection.hpp"
#include "common/runtime/cell/arm_model.hpp"
#include "tests/end_to_end/running_system.hpp"
#include "tests/ros2/foreign_node.hpp"
#include "tests/ros2/garbage.hpp"
#include "tests/support/hot_cell.hpp"
#include "tests/support/own_domain.hpp"

namespace phantom::ros2 {
namespace {

using end_to_end::RunningSystem;
using phantom::test::eventually;

double duration_s() {
  const char* given = std::getenv("PHANTOM_GARBAGE_S");
  return given == nullptr ? 20.0 : std::atof(given);
}

std::vector<std::string> joint_names() {
  std::vector<std::string> names;
  const auto model = runtime::load_arm(phantom::test::hot_cell().arm());
  for (const robot::Joint& joint : model.joints()) names.push_back(joint.name);
  return names;
}

/// A robot at rest, which publishes its joints at 100 Hz.
class Robot {
 public:
  explicit Robot(test::ForeignNode& node)
      : thread_([this, &node](const std::stop_token& stop) {
          while (!stop.stop_requested()) {
            node.publish_joints(names_, home_, std::vector<double>(home_.size(), 0.0), core::utc_ns());
            std::this_thread::sleep_for(std::chrono::milliseconds(10));
          }
        }) {}

 private:
  const std::vector<std::string> names_ = joint_names();
  const std::vector<double> home_ = phantom::test::hot_cell().arm().home;
  std::jthread thread_;
};

/// Writes garbage to each reader of the gateway's that it discovers, of whatever type.
class Attacker : observation::DiscoveryListener {
 public:
  explicit Attacker(int domain, std::uint32_t seed)
      : garbage_(seed, words()), observer_("attacker", network(domain), *this) {}

  /// Returns how many topics are attacked.
  std::size_t find_targets() {
    for (const auto& [guid, end] : ends()) {
      const auto type = type_tree(end.type);
      if (!type || writers_.contains(end.topic)) continue;
      Target target{.type = type};
      target.writer = std::make_unique<observation::PayloadWriter>(
          observer_.participant(), observation::PayloadTopic{end.topic, end.type, end.keyed}, end.qos, 16);
      writers_.emplace(end.topic, std::move(target));
    }
    return writers_.size();
  }
  /// Writes `count` messages on each topic, as fast as it goes.
  void write(int count) {
    for (auto& [topic, target] : writers_)
      for (int i = 0; i < count; ++i) target.written += target.writer->write(garbage_.message(*target.type));
  }
  std::map<std::string, std::uint64_t> written() const {
    std::map<std::string, std::uint64_t> all;
    for (const auto& [topic, target] : writers_) all[topic] = target.written;
    return all;
  }

 private:
  struct Target {
    diagnostics::TypePtr type;
    std::unique_ptr<observation::PayloadWriter> writer;
    std::uint64_t written = 0;
  };
  static core::NetworkOptions network(int domain) {
    core::NetworkOptions network;
    network.domain = domain;
    network.interfaces = network.initial_peers = {"127.0.0.1"};
    return network;
  }
  static std::vector<std::string> words() {
    auto words = joint_names();
    words.insert(words.end(), {"", "world", "ball", "base_link", "rgb8", "16UC1", "x", "y", "z"});
    return words;
  }
  // A copy: a writer is not made with the lock held that discovery waits for.
  std::map<diagnostics::Guid, diagnostics::EndpointInfo> ends() {
    const std::lock_guard lock(mutex_);
    return ends_;
  }
  void on_participant(const diagnostics::ParticipantInfo&, observation::Presence) override {}
  void on_endpoint(const diagnostics::EndpointInfo& end, observation::Presence presence) override {
    const std::lock_guard lock(mutex_);
    if (presence == observation::Presence::kAppeared && !end.writer && end.topic.starts_with("rt/"))
      ends_[end.guid] = end;
  }

  test::Garbage garbage_;
  std::mutex mutex_;
  std::map<diagnostics::Guid, diagnostics::EndpointInfo> ends_;
  observation::Observer observer_;
  std::map<std::string, Target> writers_;
};

// Without what it maps of files, which the kernel drops and reads again.
double own_MB(pid_t process) {
  std::ifstream file("/proc/" + std::to_string(process) + "/statm");
  double all = 0.0, resident = 0.0, of_files = 0.0;
  file >> all >> resident >> of_files;
  return (resident - of_files) * static_cast<double>(sysconf(_SC_PAGESIZE)) * 1e-6;
}

/// The gateway's optional inputs, of which not all go together: by their keys.
class Garbage : public testing::TestWithParam<std::vector<std::string>> {};
INSTANTIATE_TEST_SUITE_P(On, Garbage,
                         testing::Values(std::vector<std::string>{"twist_topic", "cloud_topic"},
                                         std::vector<std::string>{"joy_topic", "depth_topic",
                                                                  "camera_info_topic"}));

// Tries ros2_gateway: garbage on a topic of the ROS 2 domain
TEST_P(Garbage, OnEachTopicKillsNothingAndWhatIsSoundIsTakenAfterwards) {
  const int ros_domain = phantom::test::own_domain(1);
  std::vector<std::pair<std::string, std::string>> changes{
      {"\ndomain: 0 ", "\ndomain: " + std::to_string(ros_domain) + " "},
      {"\ninterfaces: []", "\ninterfaces: [127.0.0.1]"},
      {"\ninitial_peers: []", "\ninitial_peers: [127.0.0.1]"},
      {"  topic: \"\"                  # [0 to 200 bytes] \"\": none\n  frame: \"\"",
       "  topic: wrench\n  frame: \"\""}};
  for (const std::string& topic : GetParam()) changes.push_back({topic + ": \"\"", topic + ": " + topic});
  RunningSystem system(0.0, "ros2_arm", "", {{"ros2_gateway", changes}});
  dds::Participant observer("garbage_test", system.network());
  std::mutex mutex;
  std::uint64_t percepts = 0, valid = 0;
  core::Nanoseconds valid_ns = 0;
  dds::Reader<msg::Percept> percepts_of(observer, dds::kPercept,
                                        [&](const msg::Percept& sample, const dds::SampleInfo& info) {
                                          const std::lock_guard lock(mutex);
                                          ++percepts;
                                          if (sample.valid()) ++valid, valid_ns = info.received_ns;
                                        });
  std::uint64_t balls = 0;
  dds::Reader<msg::WorkspaceObject> objects(
      observer, dds::kWorkspaceObject, [&](const msg::WorkspaceObject& object, const dds::SampleInfo&) {
        const std::lock_guard lock(mutex);
        if (std::string(object.name().c_str()) == "sound ball" && object.mesh_hash() != 0) ++balls;
      });
  const auto valid_count = [&] {
    const std::lock_guard lock(mutex);
    return valid;
  };
  test::ForeignNode node(ros_domain, test::Distribution::kSinceIron);
  Robot robot(node);
  ASSERT_TRUE(eventually([&] { return valid_count() > 50; })) << system.output();
  // A component that refuses messages is degraded, and a session waits for its components to be ready.
  ASSERT_TRUE(
      eventually([&] { return system.output().find("All components are ready") != std::string::npos; },
                 std::chrono::seconds(110)))
      << system.output();
  std::map<std::string, pid_t> processes;
  for (const char* name :
       {"wva_server", "phantom_sensing", "ros2_gateway", "audio_percept", "synthetic_viewer"})
    ASSERT_NE(processes[name] = system.process(name), 0) << name;
  Attacker attacker(ros_domain, 20261126);
  ASSERT_TRUE(eventually([&] { return attacker.find_targets() == 3 + GetParam().size(); }));

  const pid_t gateway = processes["ros2_gateway"];
  const core::Nanoseconds begin_ns = core::monotonic_ns();
  const auto passed_s = [&] { return core::seconds(core::monotonic_ns() - begin_ns); };
  double early_MB = 0.0, greatest_MB = 0.0;
  const std::uint64_t valid_before = valid_count();
  for (int round = 0; passed_s() < duration_s(); ++round) {
    attacker.write(round % 40 == 39 ? 2000 : 20);
    attacker.find_targets();
    const double now_MB = own_MB(gateway);
    if (passed_s() < 0.25 * duration_s()) early_MB = std::max(early_MB, now_MB);
    greatest_MB = std::max(greatest_MB, now_MB);
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  const std::uint64_t valid_during = valid_count() - valid_before;
  const core::Nanoseconds end_ns = core::monotonic_ns();
  EXPECT_TRUE(eventually([&] {
    const std::lock_guard lock(mutex);
    return valid_ns > end_ns;
  })) << system.output();
  const double percept_after_s = core::seconds(core::monotonic_ns() - end_ns);
  EXPECT_TRUE(eventually([&] {
    node.publish_sphere("sound ball", 0, {0.1, 0.2, 0.9}, 0.05);
    const std::lock_guard lock(mutex);
    return balls > 0;
  })) << system.output();
  for (const auto& [name, process] : processes) EXPECT_EQ(system.process(name), process) << name << " died";
  EXPECT_LT(greatest_MB, early_MB + 40.0) << "memory grows";
  EXPECT_TRUE(system.running());
  std::cout << duration_s() << " s of garbage:";
  for (const auto& [topic, count] : attacker.written()) {
    std::cout << ' ' << topic << ' ' << count << ',';
    EXPECT_GT(count, 50.0 * duration_s()) << topic;
  }
  std::cout << " ros2_gateway: " << early_MB << " MB in the first quarter, " << greatest_MB << " MB at most; "
            << static_cast<double>(valid_during) / duration_s()
            << " valid percepts a second meanwhile; the next valid one " << percept_after_s
            << " s after the end\n";
  system.stop();
  EXPECT_EQ(system.wait(), 0) << system.output();
}

}  // namespace
}  // namespace phantom::ros2

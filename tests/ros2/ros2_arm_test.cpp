// A robot of ROS 2, and of Phantom only wva_server, phantom_sensing and ros2_gateway (and who listens and
// looks on): drag, percept and alerts come of the robot's joint_states. The robot is a node of another
// vendor's DDS.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <functional>
#include <iostream>
#include <map>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "common/core/clock.hpp"
#include "common/dds/endpoints/endpoint.hpp"
#include "common/runtime/cell/arm_model.hpp"
#include "tests/end_to_end/running_system.hpp"
#include "tests/ros2/foreign_node.hpp"
#include "tests/support/hot_cell.hpp"
#include "tests/support/own_domain.hpp"

namespace phantom::ros2 {
namespace {

using end_to_end::RunningSystem;
using phantom::test::eventually;
using testing::HasSubstr;

/// A robot that swings its gripper towards the cell's pump and into it, and publishes its joints at 100 Hz.
class Robot {
 public:
  explicit Robot(int domain) : node_(domain, test::Distribution::kSinceIron) {
    const auto& arm = phantom::test::hot_cell().arm();
    const robot::SerialArm model = runtime::load_arm(arm);
    for (const robot::Joint& joint : model.joints()) names_.push_back(joint.name);
    home_ = arm.home;
    thread_ = std::thread([this] { run(); });
  }
  ~Robot() {
    stop_ = true;
    thread_.join();
  }

 private:
  void run() {
    for (int i = 0; !stop_; ++i) {
      // To the target of a shipped reach, and beyond.
      const std::vector<double> target{0.2, -1.404, 0.959, -1.531, 0.052, 1.085, 0.0};
      const double t_s = 0.01 * i, share = 0.8 + 0.4 * std::sin(2.0 * t_s), rate = 0.8 * std::cos(2.0 * t_s);
      std::vector<double> position = home_, velocity(position.size(), 0.0);
      for (std::size_t j = 0; j < target.size(); ++j) {
        position[j] += share * (target[j] - home_[j]);
        velocity[j] = rate * (target[j] - home_[j]);
      }
      node_.publish_joints(names_, position, velocity, core::utc_ns());
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
  }

  test::ForeignNode node_;
  std::vector<std::string> names_;
  std::vector<double> home_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

/// The names of what stands in the workspace, and the version whose percept came last.
class Cell {
 public:
  explicit Cell(const core::NetworkOptions& network)
      : participant_("ros2_cell_test", network),
        objects_(participant_, dds::kWorkspaceObject,
                 [this](const msg::WorkspaceObject& o, const dds::SampleInfo&) {
                   const std::lock_guard lock(mutex_);
                   if (o.mesh_hash() == 0) {
                     places_.erase(o.id());
                   } else {
                     places_[o.id()] = {std::string(o.name().c_str()), o.X_WO().position_m().x()};
                   }
                 }) {}
  /// Returns where along x the object stands; none: it is not there.
  std::optional<double> x_of(const std::string& name) {
    const std::lock_guard lock(mutex_);
    for (const auto& [id, place] : places_)
      if (place.first == name) return place.second;
    return std::nullopt;
  }

 private:
  std::mutex mutex_;
  std::map<std::uint16_t, std::pair<std::string, double>> places_;
  dds::Participant participant_;
  dds::Reader<msg::WorkspaceObject> objects_;
};

// Tries ros2_gateway: refuses it
// Tries ros2_gateway: nobody publishes joint_states
// Tries ros2_gateway: a joint of the arm is in no message; not heard for `staleness_s`
TEST(Ros2Arm, IsFeltByItsJointStatesAlone) {
  const int ros_domain = phantom::test::own_domain(1);
  RunningSystem system(0.0, "ros2_arm", "",
                       {{"ros2_gateway",
                         {{"\ndomain: 0 ", "\ndomain: " + std::to_string(ros_domain) + " "},
                          {"\ninterfaces: []", "\ninterfaces: [127.0.0.1]"},
                          {"\ninitial_peers: []", "\ninitial_peers: [127.0.0.1]"}}}});
  dds::Participant observer("ros2_arm_test", system.network());
  std::mutex mutex;
  msg::Percept percept;
  double greatest_coefficient = 0.0, greatest_closeness = 0.0;
  std::string gateway_says;
  int percepts = 0, alerts = 0;
  std::uint64_t felt_version = 0;       // of the workspace, with which the last valid percept was made
  core::Nanoseconds felt_since_ns = 0;  // when the first percept of that version came
  dds::Reader<msg::Percept> percepts_of(
      observer, dds::kPercept, [&](const msg::Percept& sample, const dds::SampleInfo&) {
        const std::lock_guard lock(mutex);
        percept = sample;
        percepts += sample.valid() ? 1 : 0;
        if (sample.valid() && sample.workspace_version() != felt_version) {
          felt_version = sample.workspace_version();
          felt_since_ns = core::monotonic_ns();
        }
        greatest_closeness = std::max(greatest_closeness, sample.closeness());
      });
  dds::Reader<msg::DragField> drag(
      observer, dds::kDragField, [&](const msg::DragField& sample, const dds::SampleInfo&) {
        const std::lock_guard lock(mutex);
        for (std::uint32_t j = 0; j < sample.joint_count(); ++j)
          greatest_coefficient = std::max(greatest_coefficient, sample.coefficient_plus()[j]);
      });
  dds::Reader<msg::HitAlert> hits(observer, dds::kHitAlert,
                                  [&](const msg::HitAlert&, const dds::SampleInfo&) {
                                    const std::lock_guard lock(mutex);
                                    ++alerts;
                                  });
  dds::Reader<msg::ComponentStatus> states(observer, dds::kComponentStatus,
                                           [&](const msg::ComponentStatus& status, const dds::SampleInfo&) {
                                             if (status.component_name() != "ros2_gateway") return;
                                             const std::lock_guard lock(mutex);
                                             gateway_says = status.message();
                                           });
  const auto says = [&](const std::string& words) {
    return eventually([&] {
      const std::lock_guard lock(mutex);
      return gateway_says.find(words) != std::string::npos;
    });
  };
  ASSERT_TRUE(says("no publisher of joint_states")) << system.output();
  {
    Robot robot(ros_domain);
    ASSERT_TRUE(eventually([&] {
      const std::lock_guard lock(mutex);
      return percepts > 50 && greatest_closeness > 0.1 && greatest_coefficient > 0.0 && alerts > 0;
    })) << "closeness "
        << greatest_closeness << ", coefficient " << greatest_coefficient << ", " << alerts << " alerts, "
        << percepts << " valid percepts; " << gateway_says << "\n"
        << system.output();
    const std::lock_guard lock(mutex);
    EXPECT_EQ(gateway_says, "");
  }
  EXPECT_TRUE(says("joints without a state: j1_gantry")) << gateway_says;
  EXPECT_TRUE(eventually([&] {
    const std::lock_guard lock(mutex);
    return !percept.valid() && percept.condition() == msg::PerceptCondition::PERCEPT_STATE_STALE;
  }));
  test::ForeignNode planner(ros_domain, test::Distribution::kHumble);
  Cell cell(system.network());
  EXPECT_TRUE(eventually([&] {
    planner.publish_sphere("ball", 0, {0.1, 0.2, 0.9}, 0.05);
    return cell.x_of("ball") == 0.1;
  }));
  planner.publish_sphere("ghost", 3, {0.1, 0.2, 0.9}, 0.05);  // there is none to move
  planner.publish_sphere("lost", 0, {0.1, 0.2, 0.9}, 0.05, "camera");
  planner.publish_sphere("ball", 3, {0.15, 0.2, 0.9}, 0.05);
  EXPECT_TRUE(eventually([&] { return cell.x_of("ball") == 0.15; }));
  EXPECT_FALSE(cell.x_of("lost").has_value()) << "in a frame that nobody here knows";
  planner.publish_sphere("ball", 1, {}, 0.05);
  EXPECT_TRUE(eventually([&] { return !cell.x_of("ball").has_value(); }));
  Robot again(ros_domain);
  EXPECT_TRUE(eventually([&] {
    const std::lock_guard lock(mutex);
    return percept.valid() && gateway_says.empty();
  })) << "it goes on by itself";
  // From a collision object until the percept that rests on it. A busy host delays some, not the quickest.
  constexpr double kPromised_s = 0.1;
  const auto until_felt_s = [&](const std::function<void()>& change) {
    std::uint64_t before = 0;
    {
      const std::lock_guard lock(mutex);
      before = felt_version;
    }
    const core::Nanoseconds asked_ns = core::monotonic_ns();
    change();
    EXPECT_TRUE(eventually([&] {
      const std::lock_guard lock(mutex);
      return felt_version != before;
    }));
    const std::lock_guard lock(mutex);
    return core::seconds(felt_since_ns - asked_ns);
  };
  // A ball, and a table of five primitives, whose common surface has to be found first.
  const std::vector<test::Primitive> ball{{2, {0.05}, {}}};
  const std::vector<test::Primitive> table{{1, {0.3, 0.2, 0.02}, {0.0, 0.0, 0.1}},
                                           {1, {0.02, 0.02, 0.2}, {0.13, 0.08, 0.0}},
                                           {1, {0.02, 0.02, 0.2}, {-0.13, 0.08, 0.0}},
                                           {3, {0.2, 0.01}, {0.13, -0.08, 0.0}},
                                           {3, {0.2, 0.01}, {-0.13, -0.08, 0.0}}};
  for (const auto& [name, primitives] : {std::pair{"ball", ball}, {"table", table}}) {
    std::vector<double> added_s, moved_s;
    for (int i = 0; i < 11; ++i) {
      added_s.push_back(until_felt_s([&] { planner.publish_object(name, 0, {0.1, 0.2, 0.9}, primitives); }));
      moved_s.push_back(until_felt_s([&] { planner.publish_object(name, 3, {0.15, 0.2, 0.9}, {}); }));
      until_felt_s([&] { planner.publish_object(name, 1, {}, {}); });
    }
    for (std::vector<double>* times_s : {&added_s, &moved_s}) {
      std::ranges::sort(*times_s);
      EXPECT_LT(times_s->front(), kPromised_s);
      std::cout << name << (times_s == &added_s ? " added" : " moved") << " to percept: median "
                << 1e3 * (*times_s)[times_s->size() / 2] << " ms, " << 1e3 * times_s->front() << " to "
                << 1e3 * times_s->back() << " ms\n";
    }
  }
  system.stop();
  EXPECT_EQ(system.wait(), 0) << system.output();
}

}  // namespace
}  // namespace phantom::ros2

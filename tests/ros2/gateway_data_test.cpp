// What ros2_gateway hears and says beside joint states, beside another vendor's DDS: commands, points,
// wrenches, the workspace and views.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <cstring>
#include <mutex>
#include <opencv2/imgcodecs.hpp>
#include <thread>

#include "common/core/clock.hpp"
#include "common/dds/endpoints/endpoint.hpp"
#include "common/dds/tests/test_network.hpp"
#include "common/messages/codecs/haptic_device_codec.hpp"
#include "common/messages/codecs/percept_codec.hpp"
#include "common/messages/codecs/teleoperation_codec.hpp"
#include "common/messages/codecs/workspace_codec.hpp"
#include "common/messages/publisher.hpp"
#include "common/messages/topic_receiver.hpp"
#include "common/ros2/endpoint.hpp"
#include "common/workspace/brick_codec.hpp"
#include "common/workspace/compression.hpp"
#include "components/ros2_gateway/dds_adapter.hpp"
#include "components/ros2_gateway/layer_clouds.hpp"
#include "ros2_idl/std_msgsPubSubTypes.hpp"
#include "tests/ros2/gateway_rig.hpp"
#include "tests/ros2/played_server.hpp"
#include "tests/support/late_sleeper.hpp"

namespace phantom::ros2 {
namespace {

using test::Distribution;
using test::ForeignNode;

/// A master_io that takes the device and lets it feel a force.
class Master {
 public:
  explicit Master(dds::Participant& participant)
      : device(participant, dds::kHapticDevice), wrench_(participant, dds::kHapticDeviceWrench) {}
  void exert(double x_N) {
    messages::HapticDeviceWrench wrench;
    wrench.device_echo = device.last().stamp;
    wrench.force_N[0] = x_N;
    wrench.valid = wrench.leads = true;
    wrench.time_to_live_s = wrench.fade_s = 0.2;
    wrench_.publish(wrench);
  }
  Heard<msg::HapticDevice> device;

 private:
  messages::Publisher<messages::HapticDeviceWrench> wrench_;
};

// Tries ros2_gateway: a command with a number that is none; of another frame than `master.frame`
// Tries ros2_gateway: commands that stop coming
TEST_F(GatewayData, MakesTwistsADeviceThatFeelsWhatMasterIoExerts) {
  config_.master.twist_topic = "twist";
  config_.master.frame = "base_link";
  start();
  Master master(participant_);
  double x_m_s = 0.0, force_N = 0.0;
  std::string frame = "base_link";
  const auto goes_at = [&](double speed_m_s) {
    return dds::eventually([&] {
      node_.publish_twist(frame, {x_m_s, 0.0, 0.0}, {});
      master.exert(force_N);
      return std::abs(master.device.last().handle.velocity_m_s[0] - speed_m_s) < 1e-3 &&
             master.device.last().clutch;
    });
  };
  ASSERT_TRUE(goes_at(0.0)) << "seen at rest";
  x_m_s = 0.08;
  EXPECT_TRUE(goes_at(0.08));
  force_N = -3.0;
  EXPECT_TRUE(goes_at(0.08 - 3.0 / config_.master.handle.push_N_s_per_m)) << "drag slows it down";
  force_N = 0.0;
  EXPECT_TRUE(goes_at(0.08));
  const auto& device = master.device.last();
  EXPECT_TRUE(device.ready);
  EXPECT_EQ(device.able.measured_axes, 63u);
  EXPECT_EQ(device.able.period_s, 0.002);
  frame = "camera";
  phantom::test::LateSleeper late;
  const core::Nanoseconds begin_ns = core::monotonic_ns();
  EXPECT_TRUE(dds::eventually([&] {
    node_.publish_twist(frame, {x_m_s, 0.0, 0.0}, {});
    node_.publish_twist("base_link", {NAN, 0.0, 0.0}, {});
    return !master.device.last().clutch && std::abs(master.device.last().handle.velocity_m_s[0]) < 0.05;
  })) << "what is refused does not keep it going";
  constexpr double kThreadsOnTheWay = 20.0;
  EXPECT_LT(core::seconds(core::monotonic_ns() - begin_ns), 5.0 + kThreadsOnTheWay * late.greatest_s());
}

TEST_F(GatewayData, IsLedByAJoy) {
  config_.master.joy_topic = "joy";
  start();
  Master master(participant_);
  int k = 0;
  const auto comes = [&](bool clutch, double x_m_s) {
    return dds::eventually([&] {
      // Let go at first, and again from time to time, since nobody says when that was heard.
      const std::int32_t held = clutch && ++k % 400 > 40 ? 1 : 0;
      master.exert(0.0);
      node_.publish_joy({0.0F, 0.5F, 0.0F}, {0, 0, 0, 0, held});
      const auto device = master.device.last();
      return device.able.period_s > 0.0 && device.clutch == clutch &&
             std::abs(device.handle.velocity_m_s[0] - x_m_s) < 1e-3;
    });
  };
  EXPECT_TRUE(comes(false, 0.0));
  EXPECT_TRUE(comes(true, 0.05));
  EXPECT_TRUE(comes(false, 0.0));
}

TEST_F(GatewayData, SaysTheDragAsAWrenchAtTheTool) {
  start();
  messages::Publisher<messages::SlaveState> slave(participant_, dds::kSlaveState);
  messages::Publisher<messages::Percept> percepts(participant_, dds::kPercept);
  messages::SlaveState state;
  state.joint_count = 1;
  state.position[0] = 0.7;
  messages::Percept percept;
  percept.joint_count = 1;
  percept.valid = true;
  percept.drag_torque_Nm[0] = -2.0;
  std::map<std::string, test::HeardTransform> frames;
  std::vector<test::HeardWrench> heard;
  ASSERT_TRUE(dds::eventually([&] {
    slave.publish(state);
    percepts.publish(percept);
    adapter_->publish(false);
    frames.merge(node_.transforms("tf_static"));
    heard = node_.wrenches("phantom/percept/drag_wrench");
    return !heard.empty() && frames.contains("phantom/at_tool");
  }));
  EXPECT_EQ(heard.back().frame, "phantom/at_tool");
  // About the elbow, 0.5 m away along the tool's x: the moment of the force and the moment itself.
  EXPECT_NEAR(0.5 * heard.back().force_N[1] + heard.back().torque_Nm[2], -2.0, 1e-9);
}

std::uint32_t brick_of_point(const test::Cloud& cloud, std::size_t point) {
  std::uint32_t number = 0;
  std::memcpy(&number, cloud.data.data() + point * cloud.point_step + 12, 4);
  return number;
}

TEST_F(GatewayData, SaysTheWorkspaceAsCloudsByChangedBricks) {
  config_.workspace.clouds = {workspace::kOrderBoundary, 2};
  start();
  test::PlayedServer server(participant_);
  server.set({1, 2, 3}, workspace::kOrderBoundary);
  server.set({40, 2, 3}, workspace::kOrderBoundary);
  server.set({41, 2, 3}, 2);
  server.commit();
  const auto newest = [&](const std::string& topic) {
    const auto all = node_.clouds(topic);
    return all.empty() ? test::Cloud{} : all.back();
  };
  ASSERT_TRUE(dds::eventually([&] { return newest("phantom/workspace/boundary").width == 2; }));
  const test::Cloud whole = newest("phantom/workspace/boundary");
  EXPECT_EQ(whole.frame, "world");
  EXPECT_EQ(whole.height, 1u);
  EXPECT_EQ(whole.point_step, ros2_gateway::LayerCloud::kPointStep);
  EXPECT_EQ(whole.row_step, whole.data.size());
  EXPECT_EQ(whole.fields[0], std::make_tuple("x", 0u, std::uint8_t{7}, 1u));
  float x_m = 0.0F;
  std::memcpy(&x_m, whole.data.data(), 4);
  EXPECT_FLOAT_EQ(x_m, 0.015F);
  ASSERT_TRUE(dds::eventually([&] { return newest("phantom/workspace/layer_2").width == 1; }));
  EXPECT_TRUE(node_.clouds("phantom/workspace/boundary_updates").empty());
  server.set({42, 2, 3}, workspace::kOrderBoundary);
  server.commit();
  ASSERT_TRUE(dds::eventually([&] { return newest("phantom/workspace/boundary_updates").width == 2; }));
  const test::Cloud update = newest("phantom/workspace/boundary_updates");
  for (std::size_t point = 0; point < 2; ++point)
    EXPECT_EQ(brick_of_point(update, point), 1u) << "that brick alone";
  EXPECT_TRUE(node_.clouds("phantom/workspace/layer_2_updates").empty()) << "nothing of it has changed";
  EXPECT_TRUE(dds::eventually([&] { return newest("phantom/workspace/boundary").width == 3; }))
      << "whole once it is quiet";
  // Who comes late has it all, too.
  ForeignNode late(domain(), Distribution::kHumble);
  EXPECT_TRUE(dds::eventually([&] {
    const auto all = late.clouds("phantom/workspace/boundary");
    return !all.empty() && all.back().width == 3;
  }));
}

TEST_F(GatewayData, SaysTheWorkspaceAsMarkersByChangedObjects) {
  config_.workspace.meshes = true;
  start();
  test::PlayedServer server(participant_);
  const std::uint64_t mesh = server.put_mesh();
  server.put(7, 1.0, mesh);
  server.put(8, 2.0, mesh);
  server.commit();
  /// What RViz does: markers by namespace and id.
  const auto shown_by = [](ForeignNode& node) {
    std::map<int, test::HeardTriangles> shown;
    for (const auto& message : node.marker_arrays("phantom/workspace/meshes"))
      for (const auto& marker : message) {
        EXPECT_EQ(marker.ns, "phantom/objects");
        if (marker.action == 3) shown.clear();
        if (marker.action == 2) shown.erase(marker.id);
        if (marker.action == 0) shown[marker.id] = marker;
      }
    return shown;
  };
  ASSERT_TRUE(dds::eventually([&] { return shown_by(node_).size() == 2; }));
  const test::HeardTriangles one = shown_by(node_).at(7);
  EXPECT_EQ(one.type, 11);
  EXPECT_EQ(one.frame, "world");
  EXPECT_EQ(one.position[0], 1.0);
  EXPECT_EQ(one.orientation_xyzw[3], 1.0);
  ASSERT_EQ(one.points.size(), 6u) << "two triangles";
  EXPECT_EQ(one.points[1], (std::array<double, 3>{0.25, 0.0, 0.0}));
  EXPECT_EQ(one.points[5], (std::array<double, 3>{0.0, 0.0, 1.0}));
  // A reader that has come is sent all of them; what changes after that is sent alone.
  ASSERT_TRUE(dds::eventually([&] {
    const auto messages = node_.marker_arrays("phantom/workspace/meshes");
    return !messages.empty() && messages.back().size() == 3 && messages.back()[0].action == 3;
  }));
  server.put(8, 3.0, mesh);
  ASSERT_TRUE(dds::eventually([&] { return shown_by(node_).at(8).position[0] == 3.0; }));
  bool alone = false;  // a message with nothing but the moved object
  for (const auto& message : node_.marker_arrays("phantom/workspace/meshes"))
    alone = alone || (message.size() == 1 && message[0].id == 8 && message[0].position[0] == 3.0);
  EXPECT_TRUE(alone);
  server.put(7, 0.0, 0);
  EXPECT_TRUE(dds::eventually([&] { return shown_by(node_).size() == 1; }));
  ForeignNode late(domain(), Distribution::kHumble);
  EXPECT_TRUE(dds::eventually([&] { return shown_by(late).size() == 1 && shown_by(late).contains(8); }));
}

TEST_F(GatewayData, SaysTheViewersPicturesAsCompressedImages) {
  config_.out.views = true;
  start();
  messages::Publisher<messages::ViewPicture> pictures(participant_, dds::kViewPicture);
  messages::ViewPicture picture{
      .stamp = {}, .view = messages::PictureView::kTool, .jpeg = {0xff, 0xd8, 1, 2, 3}};
  std::vector<test::HeardPicture> heard;
  ASSERT_TRUE(dds::eventually([&] {
    pictures.publish(picture);
    adapter_->publish(false);
    heard = node_.pictures("phantom/views/tool/compressed");
    return !heard.empty();
  }));
  EXPECT_EQ(heard[0].format, "jpeg");
  EXPECT_EQ(heard[0].frame, "phantom/view_tool");
  EXPECT_EQ(heard[0].data, picture.jpeg);
  EXPECT_TRUE(node_.pictures("phantom/views/main/compressed").empty());
}

// Tries ros2_gateway: a message that is longer than any of its type can be
TEST(Subscription, HearsNothingOfWhatIsNotPlausible) {
  NodeOptions options{
      .domain = phantom::test::own_domain(1), .interfaces = {"127.0.0.1"}, .initial_peers = {"127.0.0.1"}};
  Node node(options), other(options);
  using Text = std_msgs::msg::dds_::String_PubSubType;
  std::atomic<int> heard{0};
  Subscription<Text> texts(node, "text", kDefault, [&](const Text::type& text, const dds::SampleInfo&) {
    EXPECT_LE(text.data().size(), kMaxOctets);
    ++heard;
  });
  Publisher<Text> publisher(other, "text", kDefault);
  ASSERT_TRUE(dds::eventually([&] { return publisher.matched() == 1; }));
  Text::type text;
  text.data(std::string(kMaxOctets + 1, 'x'));
  for (int k = 0; k < 3; ++k) publisher.publish(text);
  // Reliable readers wait for what their writer still holds, also where it is refused at each repetition.
  text.data(std::string(kMaxOctets - 100, 'y'));
  for (int k = 0; k < kDefault.history_depth; ++k) publisher.publish(text);
  EXPECT_TRUE(dds::eventually([&] { return heard > 0; }));
}

TEST(Plausible, CloudsAnnounceNoMoreFieldsThanCanBe) {
  constexpr const char* kCloud = "sensor_msgs::msg::dds_::PointCloud2_";
  for (const bool big_endian : {false, true}) {
    const auto octets = [&](const std::string& frame, std::uint32_t fields) {
      std::vector<std::uint8_t> cdr{0, static_cast<std::uint8_t>(big_endian ? 0 : 1), 0, 0};
      const auto number = [&](std::uint32_t value) {
        while (cdr.size() % 4 != 0) cdr.push_back(0);
        for (std::size_t i = 0; i < 4; ++i)
          cdr.push_back(static_cast<std::uint8_t>(value >> 8 * (big_endian ? 3 - i : i)));
      };
      number(7), number(8), number(static_cast<std::uint32_t>(frame.size() + 1));
      cdr.insert(cdr.end(), frame.begin(), frame.end());
      cdr.push_back(0);
      number(1), number(1), number(fields);
      return cdr;
    };
    for (const std::string frame : {"", "a", "ab", "abc", "abcd", "lidar_link"}) {
      EXPECT_TRUE(is_plausible(kCloud, octets(frame, kMaxFields))) << frame;
      EXPECT_FALSE(is_plausible(kCloud, octets(frame, kMaxFields + 1))) << frame;
      EXPECT_FALSE(is_plausible(kCloud, octets(frame, 4'000'000'000))) << frame;
      const auto whole = octets(frame, 3);
      for (std::size_t size = 0; size < whole.size(); ++size)
        EXPECT_FALSE(is_plausible(kCloud, std::span(whole).first(size))) << size;
    }
  }
}

}  // namespace
}  // namespace phantom::ros2

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
#include "common/dds/endpoint.hpp"
#include "common/dds/tests/test_network.hpp"
#include "common/messages/checked_reader.hpp"
#include "common/messages/haptic_device_codec.hpp"
#include "common/messages/percept_codec.hpp"
#include "common/messages/publisher.hpp"
#include "common/messages/teleoperation_codec.hpp"
#include "common/messages/workspace_codec.hpp"
#include "common/ros2/endpoint.hpp"
#include "common/workspace/brick_codec.hpp"
#include "common/workspace/compression.hpp"
#include "components/ros2_gateway/dds_adapter.hpp"
#include "components/ros2_gateway/layer_clouds.hpp"
#include "ros2_idl/std_msgsPubSubTypes.hpp"
#include "tests/ros2/foreign_node.hpp"
#include "tests/ros2/played_server.hpp"
#include "tests/support/small_arms.hpp"

namespace phantom::ros2 {
namespace {

using test::Distribution;
using test::ForeignNode;

/// What came on a topic of Phantom's.
template <class Message>
class Heard {
 public:
  using Sample = typename messages::CheckedReader<Message>::Sample;
  Heard(dds::Participant& participant, const dds::TopicSpec<Message>& topic)
      : reader_(participant, topic, {}, [this](const Sample& sample, core::Nanoseconds) {
          const std::lock_guard lock(mutex_);
          all_.push_back(sample);
        }) {}
  std::vector<Sample> all() {
    const std::lock_guard lock(mutex_);
    return all_;
  }
  Sample last() {
    const std::lock_guard lock(mutex_);
    return all_.empty() ? Sample() : all_.back();
  }

 private:
  std::mutex mutex_;
  std::vector<Sample> all_;
  messages::CheckedReader<Message> reader_;
};

/// The gateway between two domains, a node of ROS 2, and a participant of Phantom's.
class GatewayData : public testing::Test {
 protected:
  GatewayData() {
    config_.node.domain = domain();
    config_.node.interfaces = config_.node.initial_peers = {"127.0.0.1"};
    config_.joint_states_topic = config_.collision_objects_topic = "";
    config_.workspace.meshes = false;
  }
  static int domain() { return phantom::test::own_domain(1); }
  void start() {
    adapter_ = std::make_unique<ros2_gateway::DdsAdapter>(
        dds::test_network(), config_, arm_, "",
        [](const ros2_gateway::JointStateMessage&, messages::SlaveState&) { return false; });
  }
  void TearDown() override { adapter_.reset(); }

  robot::SerialArm arm_ = phantom::test::one_joint();
  ros2_gateway::GatewayConfig config_;
  dds::Participant participant_{"observer", dds::test_network()};
  std::unique_ptr<ros2_gateway::DdsAdapter> adapter_;
  ForeignNode node_{domain(), Distribution::kSinceIron};
};

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
  const core::Nanoseconds begin_ns = core::monotonic_ns();
  EXPECT_TRUE(dds::eventually([&] {
    node_.publish_twist(frame, {x_m_s, 0.0, 0.0}, {});
    node_.publish_twist("base_link", {NAN, 0.0, 0.0}, {});
    return !master.device.last().clutch && std::abs(master.device.last().handle.velocity_m_s[0]) < 0.05;
  })) << "what is refused does not keep it going";
  EXPECT_LT(core::seconds(core::monotonic_ns() - begin_ns), 5.0);
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

test::Cloud three_points() {
  test::Cloud cloud{.frame = "lidar",
                    .stamp_ns = core::utc_ns(),
                    .height = 1,
                    .width = 3,
                    .point_step = 16,
                    .row_step = 48,
                    .fields = {{"x", 0, 7, 1}, {"y", 4, 7, 1}, {"z", 8, 7, 1}, {"intensity", 12, 7, 1}},
                    .data = {}};
  const float values[] = {1, 2, 3, 9, NAN, 2, 3, 9, 4, 5, 6, 9};
  cloud.data.resize(sizeof(values));
  std::memcpy(cloud.data.data(), values, sizeof(values));
  return cloud;
}

// Tries ros2_gateway: a cloud or an image whose fields, sizes or numbers are not as its definition has them
TEST_F(GatewayData, HandsOnTheCloudOfASensor) {
  config_.points.cloud_topic = "cloud";
  start();
  Heard<msg::SensorPoints> points(participant_, dds::kSensorPoints);
  std::int64_t stamp_ns = 0;
  ASSERT_TRUE(dds::eventually([&] {
    test::Cloud cloud = three_points();
    stamp_ns = cloud.stamp_ns;
    node_.publish_cloud(cloud);
    return !points.all().empty();
  }));
  const auto first = points.all().front();
  EXPECT_EQ(first.frame, "lidar");
  EXPECT_EQ(first.width, 3u);
  EXPECT_NEAR(static_cast<double>(first.measured_utc_ns), static_cast<double>(stamp_ns), 30e9);
  ASSERT_EQ(first.xyz_m.size(), 9u);
  EXPECT_EQ(first.xyz_m[1], 2.0F);
  EXPECT_TRUE(std::isnan(first.xyz_m[3]) && std::isnan(first.xyz_m[4]));
  EXPECT_EQ(first.xyz_m[8], 6.0F);
  // None of these comes through; what is sound after them does.
  for (const auto& damage : std::vector<std::function<void(test::Cloud&)>>{
           [](auto& c) { c.width = 4'000'000'000; }, [](auto& c) { c.height = 2; },
           [](auto& c) { c.fields.pop_back(), c.fields.pop_back(); },
           [](auto& c) { c.fields.resize(100, c.fields[0]); }, [](auto& c) { c.stamp_ns -= 10'000'000'000; },
           [](auto& c) { c.data.clear(); }}) {
    test::Cloud cloud = three_points();
    cloud.frame = "damaged";
    damage(cloud);
    node_.publish_cloud(cloud);
  }
  EXPECT_TRUE(dds::eventually([&] {
    test::Cloud cloud = three_points();
    cloud.frame = "again";
    node_.publish_cloud(cloud);
    return points.last().frame == "again";
  }));
  for (const auto& one : points.all()) EXPECT_NE(one.frame, "damaged");
}

// Tries ros2_gateway: depth images without their camera_info
TEST_F(GatewayData, HandsOnDepthImagesAsPoints) {
  config_.points.depth_topic = "depth";
  config_.points.camera_info_topic = "camera_info";
  start();
  Heard<msg::SensorPoints> points(participant_, dds::kSensorPoints);
  const auto send = [&] { node_.publish_depth("camera", 2, 1, {2.0F, 0.0F}); };
  for (int k = 0; k < 20; ++k) send();
  EXPECT_TRUE(points.all().empty()) << "where its pixels look is not known";
  ASSERT_TRUE(dds::eventually([&] {
    node_.publish_camera("camera", 2, 1, {100, 0, 1, 0, 0, 100, 0.5, 0, 0, 0, 1, 0});
    send();
    return !points.all().empty();
  }));
  const auto one = points.last();
  EXPECT_EQ(one.frame, "camera");
  ASSERT_EQ(one.xyz_m.size(), 6u);
  EXPECT_FLOAT_EQ(one.xyz_m[0], -1.0F * 2.0F / 100.0F);
  EXPECT_FLOAT_EQ(one.xyz_m[1], -0.5F * 2.0F / 100.0F);
  EXPECT_FLOAT_EQ(one.xyz_m[2], 2.0F);
  EXPECT_TRUE(std::isnan(one.xyz_m[5]));
}

/// A picture whose left half is red and whose right half is blue, in the order of an Image's encoding.
std::vector<std::uint8_t> red_and_blue(const char* encoding, std::uint32_t width, std::uint32_t height,
                                       std::uint32_t step) {
  std::vector<std::uint8_t> data(std::size_t{step} * height, 7);
  const std::size_t red = std::string(encoding) == "rgb8" ? 0 : 2;
  for (std::size_t row = 0; row < height; ++row)
    for (std::size_t x = 0; x < width; ++x)
      for (std::size_t c = 0; c < 3; ++c)
        data[row * step + 3 * x + c] = c == (x < width / 2 ? red : 2 - red) ? 230 : 20;
  return data;
}
void expect_red_and_blue(const messages::CameraPicture& picture) {
  const cv::Mat image = cv::imdecode(picture.jpeg, cv::IMREAD_COLOR);
  ASSERT_EQ(image.size(), cv::Size(static_cast<int>(picture.width), static_cast<int>(picture.height)));
  for (const auto& [x, channel] : {std::pair{4, 2}, {image.cols - 5, 0}})
    for (int c = 0; c < 3; ++c)
      EXPECT_NEAR(image.at<cv::Vec3b>(image.rows / 2, x)[c], c == channel ? 230 : 20, 25) << x << ' ' << c;
}

// Tries ros2_gateway: a camera's picture of another encoding
TEST_F(GatewayData, HandsOnThePicturesOfACamera) {
  config_.camera.image_topic = "image";
  config_.camera.name = "gate";
  config_.camera.rate_Hz = 120.0;
  start();
  Heard<msg::CameraPicture> pictures(participant_, dds::kCameraPicture);
  const core::Nanoseconds begin_ns = core::utc_ns();
  for (const char* encoding : {"rgb8", "bgr8"}) {
    const std::uint32_t width = encoding[0] == 'r' ? 64 : 66;
    // None of these comes through; what is sound after them does.
    for (int k = 0; k < 20; ++k) {
      node_.publish_image("bayer_rggb8", 64, 50, 64, std::vector<std::uint8_t>(64 * 50));
      node_.publish_image("yuv422", 64, 50, 128, std::vector<std::uint8_t>(128 * 50));
      node_.publish_image("rgb8", 4'000'000'000, 4'000'000'000, 12, {1, 2, 3});
      node_.publish_image("rgb8", 64, 50, 190, std::vector<std::uint8_t>(190 * 50));
    }
    ASSERT_TRUE(dds::eventually([&] {
      node_.publish_image(encoding, width, 48, 200, red_and_blue(encoding, width, 48, 200));
      return !pictures.all().empty() && pictures.last().width == width;
    })) << encoding;
    const auto picture = pictures.last();
    EXPECT_EQ(picture.camera, "gate");
    EXPECT_GE(picture.exposed_utc_ns, begin_ns);
    EXPECT_LE(picture.exposed_utc_ns, core::utc_ns());
    expect_red_and_blue(picture);
  }
  for (const auto& picture : pictures.all()) EXPECT_EQ(picture.height, 48u);
}

TEST_F(GatewayData, HandsOnACamerasCompressedPicturesAndJpegAsItCame) {
  config_.camera.compressed_topic = "image/compressed";
  config_.camera.largest_stamp_age_s = 0.0;
  config_.camera.rate_Hz = 120.0;
  start();
  Heard<msg::CameraPicture> pictures(participant_, dds::kCameraPicture);
  const auto data = red_and_blue("bgr8", 64, 48, 192);
  const cv::Mat image(48, 64, CV_8UC3, const_cast<std::uint8_t*>(data.data()));
  std::vector<std::uint8_t> jpeg, png;
  cv::imencode(".jpg", image, jpeg);
  for (int k = 0; k < 20; ++k) node_.publish_compressed("16UC1; compressedDepth png", {1, 2, 3, 4});
  ASSERT_TRUE(dds::eventually([&] {
    node_.publish_compressed("rgb8; jpeg compressed bgr8", jpeg);
    return !pictures.all().empty();
  }));
  for (const auto& picture : pictures.all()) EXPECT_EQ(picture.jpeg, jpeg);
  EXPECT_EQ(pictures.last().camera, "camera");
  EXPECT_EQ(pictures.last().exposed_utc_ns, 0) << "a clock that is not trusted is not handed on";
  cv::imencode(".png", image, png);
  ASSERT_TRUE(dds::eventually([&] {
    node_.publish_compressed("png", png);
    return pictures.last().jpeg != jpeg;
  }));
  expect_red_and_blue(pictures.last());
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
    EXPECT_LE(text.data().size(), kMostOctets);
    ++heard;
  });
  Publisher<Text> publisher(other, "text", kDefault);
  ASSERT_TRUE(dds::eventually([&] { return publisher.matched() == 1; }));
  Text::type text;
  for (int k = 0; k < 3; ++k) {
    text.data(std::string(kMostOctets + 1, 'x'));
    publisher.publish(text);
    text.data(std::string(kMostOctets - 100, 'y'));
    publisher.publish(text);
  }
  EXPECT_TRUE(dds::eventually([&] { return heard == 3; })) << heard;
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
      EXPECT_TRUE(is_plausible(kCloud, octets(frame, kMostFields))) << frame;
      EXPECT_FALSE(is_plausible(kCloud, octets(frame, kMostFields + 1))) << frame;
      EXPECT_FALSE(is_plausible(kCloud, octets(frame, 4'000'000'000))) << frame;
      const auto whole = octets(frame, 3);
      for (std::size_t size = 0; size < whole.size(); ++size)
        EXPECT_FALSE(is_plausible(kCloud, std::span(whole).first(size))) << size;
    }
  }
}

}  // namespace
}  // namespace phantom::ros2

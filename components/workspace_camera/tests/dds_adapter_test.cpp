#include "components/workspace_camera/dds_adapter.hpp"

#include <gtest/gtest.h>

#include <map>
#include <mutex>
#include <thread>

#include "common/core/snapshot.hpp"
#include "common/dds/endpoints/endpoint.hpp"
#include "common/dds/tests/test_network.hpp"
#include "common/messages/codecs/status_codec.hpp"
#include "common/messages/codecs/teleoperation_codec.hpp"
#include "common/messages/codecs/workspace_codec.hpp"
#include "common/messages/publisher.hpp"
#include "common/messages/topic_receiver.hpp"
#include "components/workspace_camera/tests/rig.hpp"

namespace phantom::workspace_camera::dds_adapter_test {
namespace {

messages::DepthImage an_image(std::uint16_t depth_mm, const std::string& camera = "above") {
  messages::DepthImage image;
  image.camera = camera;
  image.width = 64, image.height = 48;
  image.fx_px = image.fy_px = 60.0;
  image.min_depth_m = 0.2, image.max_depth_m = 4.0;
  image.depth_mm.assign(64 * 48, depth_mm);
  return image;
}

/// A camera's process.
struct CameraProcess {
  explicit CameraProcess(const core::NetworkOptions& network) : participant("camera", network) {}
  dds::Participant participant;
  messages::Publisher<messages::DepthImage> images{participant, dds::kDepthImage};
};

TEST(DdsAdapter, BringsTheImagesOfItsCamerasAlone) {
  const core::NetworkOptions network = dds::test_network();
  ArmHistory history;
  DdsAdapter adapter(network, "workspace_camera", {"left", "above"}, nullptr, history);
  CameraProcess sender(network);
  std::optional<DdsAdapter::Image> image;
  EXPECT_TRUE(dds::eventually([&] {
    sender.images.publish(an_image(777, "of another cell"));
    sender.images.publish(an_image(1234));
    image = adapter.next_image(0.01);
    return image.has_value();
  }));
  ASSERT_TRUE(image);
  EXPECT_EQ(image->camera, 1U);
  EXPECT_EQ(image->depth_mm, an_image(1234).depth_mm);
  EXPECT_GT(image->received_ns, 0);
}

TEST(DdsAdapter, AWaitForAnImageEndsOnceItIsWoken) {
  ArmHistory history;
  DdsAdapter adapter(dds::test_network(), "workspace_camera", {"above"}, nullptr, history);
  constexpr double kAnHour_s = 3600.0;  // the test ends by its own limit if nobody wakes it
  adapter.wake();
  EXPECT_FALSE(adapter.next_image(kAnHour_s)) << "also if it was woken before it waits";
  std::jthread other([&] { adapter.wake(); });
  EXPECT_FALSE(adapter.next_image(kAnHour_s));
}

// Tries workspace_camera: two processes send the images of one camera
TEST(DdsAdapter, OfTwoSendersOfOneCameraTheFirstIsFollowed) {
  const core::NetworkOptions network = dds::test_network();
  ArmHistory history;
  DdsAdapter adapter(network, "workspace_camera", {"above"}, nullptr, history);
  CameraProcess first(network);
  ASSERT_TRUE(dds::eventually([&] {
    first.images.publish(an_image(1000));
    return adapter.next_image(0.01).has_value();
  }));
  CameraProcess second(network);
  dds::Waiter waiter;
  std::string message;
  dds::Reader<msg::ComponentStatus> status(first.participant, dds::kComponentStatus,
                                           [&](const msg::ComponentStatus& sample, const dds::SampleInfo&) {
                                             waiter.change([&] { message = sample.message().c_str(); });
                                           });
  EXPECT_TRUE(dds::eventually([&] {
    first.images.publish(an_image(1000));
    second.images.publish(an_image(2000));
    while (const auto image = adapter.next_image(0.005))
      EXPECT_EQ(image->depth_mm[0], 1000) << "of the second";
    adapter.report({core::ComponentState::kRunning, "", {}, {}});
    return waiter.wait([&] { return message.find("depth_image") != std::string::npos; },
                       std::chrono::seconds(0));
  }));
}

TEST(DdsAdapter, WhoeverJoinsLaterGetsTheNewestFindingOfEachObject) {
  const core::NetworkOptions network = dds::test_network();
  ArmHistory history;
  DdsAdapter adapter(network, "workspace_camera", {}, nullptr, history);
  messages::PoseFinding drum{.id = 3, .verdict = messages::PoseVerdict::kGone, .camera = "above"},
      valve{.id = 4, .verdict = messages::PoseVerdict::kAgrees, .camera = "above"};
  adapter.publish(drum);
  adapter.publish(valve);
  drum.verdict = messages::PoseVerdict::kElsewhere;
  drum.shift_m = 0.1;
  drum.unseen = "along x";
  adapter.publish(drum);
  dds::Participant other("other", network);
  std::mutex mutex;
  std::map<std::uint16_t, messages::PoseFinding> got;
  const dds::Reader<msg::PoseFinding> reader(other, dds::kPoseFinding,
                                             [&](const msg::PoseFinding& message, const dds::SampleInfo&) {
                                               const auto finding = messages::from_idl(message);
                                               if (!finding) return false;
                                               const std::lock_guard lock(mutex);
                                               got[finding->id] = *finding;
                                               return true;
                                             });
  EXPECT_TRUE(dds::eventually([&] {
    const std::lock_guard lock(mutex);
    return got.size() == 2 && got[3].shift_m == 0.1;
  }));
  EXPECT_EQ(got[3].verdict, messages::PoseVerdict::kElsewhere);
  EXPECT_EQ(got[3].unseen, "along x");
  EXPECT_EQ(got[3].camera, "above");
  EXPECT_EQ(got[4].verdict, messages::PoseVerdict::kAgrees);
}

TEST(DdsAdapter, HowOldTheViewIsComesToItsReaders) {
  const core::NetworkOptions network = dds::test_network();
  ArmHistory history;
  DdsAdapter adapter(network, "workspace_camera", {}, nullptr, history);
  dds::Participant other("phantom_sensing", network);
  core::Snapshot<int> heard;
  messages::TopicSubscriber<msg::SpaceView> reader(
      other, dds::kSpaceView, messages::ArmBounds(),
      [&](const messages::Received<messages::SpaceView>& view) { heard.write(view.ages.at(1)); });
  const WorkspaceCamera camera(rig::config(), "workspace_camera", "cell", rig::grid(), nullptr, history);
  EXPECT_TRUE(dds::eventually([&] {
    adapter.publish(camera.space_view(rig::kStart));
    int age = 0;
    return heard.read(age) && age == messages::kSpaceNeverSeen;
  }));
}

TEST(DdsAdapter, WhoeverJoinsIsToldOnceWhole) {
  const core::NetworkOptions network = dds::test_network();
  ArmHistory history;
  DdsAdapter adapter(network, "workspace_camera", {}, nullptr, history);
  messages::OccupancyChange whole;
  whole.source = "workspace_camera", whole.cell = "cell", whole.grid = rig::grid(), whole.whole = true;
  EXPECT_TRUE(adapter.publish(whole));
  EXPECT_FALSE(adapter.has_newcomer());
  dds::Participant other("wva_server", network);
  dds::Waiter waiter;
  int heard = 0;
  dds::Reader<msg::OccupancyChange> reader(other, dds::kOccupancyChange,
                                           [&](const msg::OccupancyChange& sample, const dds::SampleInfo&) {
                                             waiter.change([&] { heard += sample.whole() ? 1 : 0; });
                                           });
  ASSERT_TRUE(dds::eventually([&] { return adapter.has_newcomer(); }));
  messages::OccupancyChange change = whole;
  change.whole = false;
  EXPECT_FALSE(adapter.publish(change)) << "the newcomer needs a whole one";
  EXPECT_TRUE(adapter.publish(whole));
  EXPECT_FALSE(adapter.has_newcomer());
  EXPECT_TRUE(waiter.wait([&] { return heard == 1; }));
}

}  // namespace
}  // namespace phantom::workspace_camera::dds_adapter_test

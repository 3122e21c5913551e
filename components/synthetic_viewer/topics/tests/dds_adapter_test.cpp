#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <limits>

#include "common/dds/endpoints/stamp.hpp"
#include "common/dds/tests/test_network.hpp"
#include "common/messages/codecs/teleoperation_codec.hpp"
#include "common/messages/codecs/workspace_codec.hpp"
#include "common/messages/publisher.hpp"
#include "common/messages/status_reporter.hpp"
#include "common/percept/view_node.hpp"
#include "components/synthetic_viewer/topics/tests/adapter_rig.hpp"

namespace phantom::synthetic_viewer {
namespace {

using dds::eventually;
using dds::test_network;

// A late, a repeated and an unsound sample change nothing; a restarted writer is listened to.
TEST_F(Adapter, TakesTheNewestSoundStateAndARestartedWriter) {
  dds::Writer<msg::SlaveState> writer(other_, dds::kSlaveState);
  ASSERT_TRUE(eventually([&] { return writer.matched() >= 1; }));
  ArmSample sample;
  // Best effort: said again until it has come. `number` is what tells the samples apart.
  const auto send = [&](std::uint64_t session, std::uint64_t number, double position) {
    msg::SlaveState message = slave_state();
    msg::Stamp made = stamp(number);
    made.session(session);
    message.stamp(made);
    message.position_rad()[0] = position;
    writer.write(message);
  };
  ASSERT_TRUE(eventually([&] {
    send(5, 10, 0.1);
    return inbox_.arm.read(sample);
  }));
  EXPECT_EQ(sample.position[0], 0.1);
  EXPECT_GT(sample.received_ns, 0);
  send(5, 9, 0.9);
  send(5, 10, 0.9);
  send(5, 12, kNan);
  ASSERT_TRUE(eventually([&] {
    send(5, 11, 0.2);
    return inbox_.arm.read(sample);
  }));
  EXPECT_EQ(sample.position[0], 0.2);
  ASSERT_TRUE(eventually([&] {
    send(6, 1, 0.3);
    return inbox_.arm.read(sample);
  }));
  EXPECT_EQ(sample.position[0], 0.3);
}

TEST_F(Adapter, StatesOfAnotherArmComeFromItsPartitionForPicturesAndBrowsers) {
  core::NetworkOptions there = test_network();
  there.partition = "pair/b";
  Inbox inbox;
  DdsAdapter adapter(test_network(), kShape, inbox, {}, {{"b", "pair/b", kShape}});
  dds::Participant neighbour("neighbour", there);
  dds::Writer<msg::SlaveState> writer(neighbour, dds::kSlaveState), own(other_, dds::kSlaveState);
  ArmSample sample, for_browsers, of_own;
  std::uint64_t number = 0;
  ASSERT_TRUE(eventually([&] {
    msg::SlaveState message = slave_state();
    message.stamp(stamp(++number));
    message.position_rad()[0] = 0.4;
    writer.write(message);
    message.position_rad()[0] = -0.4;
    own.write(message);
    inbox.others[0].read<Inbox::kScene>(for_browsers);
    inbox.arm.read(of_own);
    return inbox.others[0].read(sample) && for_browsers.received_ns != 0 && of_own.received_ns != 0;
  }));
  EXPECT_EQ(sample.position[0], 0.4);
  EXPECT_EQ(for_browsers.position[0], 0.4);
  EXPECT_EQ(of_own.position[0], -0.4);
  EXPECT_EQ(inbox.past.other_at(0, sample.received_ns, core::kNsPerSecond).position[0], 0.4)
      << "for a camera's picture";
  EXPECT_EQ(inbox.past.arm_at(of_own.received_ns, core::kNsPerSecond).position[0], -0.4);
}

TEST_F(Adapter, ObjectsComeToLateJoinersAndGoWhenRemoved) {
  dds::Writer<msg::WorkspaceObject> writer(other_, dds::kWorkspaceObject);
  msg::WorkspaceObject object;
  object.X_WO().qw(1);
  object.mesh_hash(5);
  for (std::uint16_t id = 1; id <= 12; ++id) {
    object.id(id);
    writer.write(object);
  }
  ASSERT_TRUE(eventually([&] { return got<ObjectSample>().size() == 12; }));
  object.id(7);
  object.mesh_hash(0);
  writer.write(object);
  ASSERT_TRUE(eventually([&] { return got<ObjectSample>().size() == 13; }));
  EXPECT_TRUE(got<ObjectSample>()[12].removed());
  EXPECT_EQ(got<ObjectSample>()[12].id, 7);
}

TEST_F(Adapter, AlertsArriveInOrderAndComponentsByName) {
  dds::Writer<msg::HitAlert> writer(other_, dds::kHitAlert);
  messages::StatusReporter reporter(other_);
  ASSERT_TRUE(eventually([&] { return writer.matched() >= 1; }));
  for (std::uint32_t alert = 1; alert <= 5; ++alert) {
    msg::HitAlert message;
    message.stamp(stamp(alert));
    message.alert(alert);
    writer.write(message);
  }
  ASSERT_TRUE(eventually([&] { return got<HitSample>().size() == 5; }));
  const auto hits = got<HitSample>();
  for (std::size_t i = 0; i < hits.size(); ++i) EXPECT_EQ(hits[i].alert, i + 1);
  const auto heard = [&] {
    for (const ComponentSample& component : got<ComponentSample>()) {
      if (component.component == "other") return true;
    }
    return false;
  };
  EXPECT_TRUE(eventually([&] {
    reporter.publish({});
    return heard();
  }));
}

// What an alert's picture shows is what was known when it came, however late it is drawn.
TEST_F(Adapter, AnAlertKeepsTheArmAndThePerceptOfItsMoment) {
  dds::Writer<msg::SlaveState> states(other_, dds::kSlaveState);
  dds::Writer<msg::Percept> percepts(other_, dds::kPercept);
  dds::Writer<msg::HitAlert> alerts(other_, dds::kHitAlert);
  ASSERT_TRUE(
      eventually([&] { return states.matched() >= 1 && percepts.matched() >= 1 && alerts.matched() >= 1; }));
  std::uint64_t number = 0;
  ArmSample arm;
  PerceptSample percept;
  const auto send_as = [&](double value) {
    EXPECT_TRUE(eventually([&] {
      msg::SlaveState state = slave_state();
      state.stamp(stamp(++number));
      state.position_rad()[0] = value;
      states.write(state);
      return inbox_.arm.read(arm) && arm.position[0] == value;
    }));
    EXPECT_TRUE(eventually([&] {
      msg::Percept message;
      message.stamp(stamp(++number));
      message.joint_count(7);
      message.closeness(value);
      percepts.write(message);
      return inbox_.percept.read(percept) && percept.closeness == value;
    }));
  };
  const auto raise = [&](std::uint32_t alert) {
    msg::HitAlert message;
    message.stamp(stamp(alert));
    message.alert(alert);
    alerts.write(message);
    EXPECT_TRUE(eventually([&] { return got<HitSample>().size() == alert; }));
  };
  raise(1);
  send_as(0.25);
  raise(2);
  send_as(0.75);
  const auto hits = got<HitSample>();
  ASSERT_EQ(hits.size(), 2U);
  EXPECT_EQ(hits[0].arm.received_ns, 0) << "there was none yet";
  EXPECT_EQ(hits[1].arm.position[0], 0.25);
  EXPECT_EQ(hits[1].percept.closeness, 0.25);
  EXPECT_GT(hits[1].arm.received_ns, 0);
}

// Two slave_io: the picture used to alternate between two arms.
// Tries synthetic_viewer: two processes send one topic
TEST_F(Adapter, KeepsToTheFirstOfTwoWritersAndTellsOfTheSecond) {
  dds::Participant second_host("second", test_network());
  dds::Writer<msg::SlaveState> first(other_, dds::kSlaveState), second(second_host, dds::kSlaveState);
  ASSERT_TRUE(eventually([&] { return first.matched() >= 1 && second.matched() >= 1; }));
  dds::Stamper first_stamps(other_), second_stamps(second_host);
  ArmSample sample;
  const auto send = [&](dds::Writer<msg::SlaveState>& writer, dds::Stamper& stamps, double position) {
    msg::SlaveState message = slave_state();
    message.stamp(stamps.next());
    message.position_rad()[0] = position;
    writer.write(message);
  };
  ASSERT_TRUE(eventually([&] {
    send(first, first_stamps, 0.1);
    return inbox_.arm.read(sample);
  }));
  bool reported = false;
  for (int k = 0; k < 5000 && !reported; ++k) {
    send(first, first_stamps, 0.1);
    send(second, second_stamps, 0.9);
    usleep(1000);
    if (inbox_.arm.read(sample)) {
      ASSERT_EQ(sample.position[0], 0.1);
    }
    reported = !inbox_.stops.at(core::monotonic_ns()).notices.empty();
  }
  EXPECT_TRUE(reported);
  // Once the first has gone, the second is its successor, and nothing is said any more.
  ASSERT_TRUE(eventually([&] {
    send(second, second_stamps, 0.9);
    return inbox_.arm.read(sample) && sample.position[0] == 0.9;
  }));
  EXPECT_TRUE(eventually([&] {
    send(second, second_stamps, 0.9);
    return inbox_.stops.at(core::monotonic_ns()).notices.empty();
  }));
}

TEST_F(Adapter, TakesAlertsOfThePhantomWhosePerceptItShowsOnly) {
  dds::Participant second_host("second", test_network());
  dds::Writer<msg::Percept> percepts(other_, dds::kPercept);
  dds::Writer<msg::HitAlert> alerts(other_, dds::kHitAlert), others(second_host, dds::kHitAlert);
  ASSERT_TRUE(
      eventually([&] { return percepts.matched() > 0 && alerts.matched() > 0 && others.matched() > 0; }));
  dds::Stamper stamps(other_), alert_stamps(other_), other_stamps(second_host);
  PerceptSample sample;
  for (std::uint32_t number = 1; got<HitSample>().size() < 5 && number < 3000; ++number) {
    msg::Percept percept;
    percept.stamp(stamps.next());
    percept.joint_count(7);
    percepts.write(percept);
    if (!inbox_.percept.read(sample)) continue;
    msg::HitAlert alert;
    alert.alert(number);
    alert.stamp(other_stamps.next());
    alert.look_at_m().x(9);
    others.write(alert);
    alert.stamp(alert_stamps.next());
    alert.look_at_m().x(1);
    alerts.write(alert);
    usleep(5000);
  }
  ASSERT_GE(got<HitSample>().size(), 5U);
  for (const HitSample& hit : got<HitSample>()) EXPECT_EQ(hit.look_at_m[0], 1);
}

TEST_F(Adapter, ItsViewPoseReachesOthers) {
  dds::Waiter waiter;
  std::vector<msg::ViewPose> heard;
  dds::Reader<msg::ViewPose> reader(other_, dds::kViewPose,
                                    [&](const msg::ViewPose& pose, const dds::SampleInfo&) {
                                      waiter.change([&] { heard.push_back(pose); });
                                    });
  ViewPoseSample view;
  view.hit_zone = true;
  view.node = 12;
  view.automatic = true;
  view.X_WC = {percept::view_axes(-Eigen::Vector3d::UnitX()).transpose(), {1, 2, 3}};
  view.look_at_m = {2, 2, 3};
  ASSERT_TRUE(eventually([&] {
    adapter_.publish(view);
    return waiter.wait([&] { return !heard.empty(); }, std::chrono::seconds(0));
  }));
  const msg::ViewPose& pose = heard.front();
  EXPECT_GT(pose.stamp().sequence_number(), 0U);
  EXPECT_EQ(pose.view(), msg::ViewKind::VIEW_HIT);
  EXPECT_EQ(pose.node(), 12U);
  EXPECT_TRUE(pose.automatic());
  EXPECT_EQ(pose.X_WC().position_m().y(), 2);
  EXPECT_EQ(pose.look_at_m().x(), 2);
  const Eigen::Matrix3d rotation = geometry::rotation_from_quaternion(
      Eigen::Vector4d(pose.X_WC().qx(), pose.X_WC().qy(), pose.X_WC().qz(), pose.X_WC().qw()));
  EXPECT_TRUE(rotation.isApprox(view.X_WC.rotation, 1e-12));
}

TEST_F(Adapter, PicturesOfItsCameraComeToTheInboxAndOthersAreNamed) {
  Inbox inbox;
  const DdsAdapter with_camera(test_network(), kShape, inbox, "gate");
  messages::Publisher<messages::CameraPicture> writer(other_, dds::kCameraPicture);
  messages::CameraPicture picture{
      .stamp = {}, .camera = "door", .exposed_utc_ns = 0, .width = 64, .height = 48, .jpeg = {1, 2, 3}};
  PictureInbox::News news;
  const auto comes = [&](const auto& what) {  // best effort: until one has come
    return eventually([&] {
      writer.publish(picture);
      news = inbox.video.take();
      return what(news);
    });
  };
  EXPECT_TRUE(comes([](const auto& n) { return n.foreign == "door" && !n.picture; }));
  picture.camera = "gate";
  picture.exposed_utc_ns = core::utc_ns() - core::from_seconds(0.2);
  ASSERT_TRUE(comes([](const auto& n) { return n.picture.has_value(); }));
  EXPECT_EQ(news.picture->jpeg, picture.jpeg);
  ASSERT_TRUE(news.picture->exposed_ns.has_value());
  EXPECT_NEAR(core::seconds(news.picture->arrived_ns - *news.picture->exposed_ns), 0.2, 4.8);
  EXPECT_GE(core::seconds(news.picture->arrived_ns - *news.picture->exposed_ns), 0.19);
  picture.exposed_utc_ns -= core::from_seconds(60.0);
  EXPECT_TRUE(
      comes([](const auto& n) { return n.refusal.find("allowed: at most 5 s ago") != std::string::npos; }));
}

TEST_F(Adapter, ItsPicturesReachOthersWhileTheyAreFollowedAndEachOnce) {
  PageContent page;
  const auto publish = [&] { adapter_.publish_pictures(page, 1000.0); };
  publish();
  web::Broadcast<std::string>& tool = page.view(View::kTool).jpeg;
  EXPECT_EQ(tool.followers, 0) << "nobody reads the topic";
  {
    std::atomic<int> first{0}, last{0};
    dds::Reader<msg::ViewPicture> reader(other_, dds::kViewPicture,
                                         [&](const msg::ViewPicture& picture, const dds::SampleInfo&) {
                                           EXPECT_EQ(picture.view(), msg::PictureView::PICTURE_TOOL);
                                           ASSERT_EQ(picture.jpeg().size(), 3u) << "larger ones are not sent";
                                           ++(picture.jpeg()[0] == 'a' ? first : last);
                                         });
    ASSERT_TRUE(eventually([&] {
      publish();
      return tool.followers == 1;
    }));
    int made = 0;
    const auto send_until = [&](const char* picture, const std::atomic<int>& heard) {
      return eventually([&] {  // best effort: a new one, until one has come
        tool.publish(std::string(picture));
        ++made;
        publish();
        return heard > 0;
      });
    };
    ASSERT_TRUE(send_until("abc", first));
    const int made_of_first = made;
    for (int k = 0; k < 50; ++k) publish();
    tool.publish(std::string(messages::kMaxPictureBytes + 1, 'x'));
    publish();
    ASSERT_TRUE(send_until("def", last));
    EXPECT_LE(first, made_of_first) << "each is sent once";
  }
  EXPECT_TRUE(eventually([&] {
    publish();
    return tool.followers == 0;
  }));
}

TEST(InboxQueue, IsBoundedAndCountsWhatItLoses) {
  Inbox inbox;
  for (int k = 0; k < 20000; ++k) inbox.put(WorkspaceSample{});
  EXPECT_EQ(inbox.take_events().size() + inbox.lost(), 20000U);
  EXPECT_GT(inbox.lost(), 0U);
  EXPECT_TRUE(inbox.put(WorkspaceSample{}));
}

TEST(InboxQueue, AnAlertEndsTheWait) {
  Inbox inbox;
  inbox.put(HitSample{});
  const core::Nanoseconds begin = core::monotonic_ns();
  inbox.wait_until(begin + 600 * core::kNsPerSecond);
  EXPECT_LT(core::monotonic_ns() - begin, 300 * core::kNsPerSecond);
}

}  // namespace
}  // namespace phantom::synthetic_viewer

#include "components/synthetic_viewer/dds_adapter.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "common/dds/stamp.hpp"
#include "common/dds/status_reporter.hpp"
#include "common/dds/tests/test_network.hpp"

namespace phantom::synthetic_viewer {
namespace {

constexpr ArmShape kShape{7, 8};
const double kNan = std::numeric_limits<double>::quiet_NaN();

msg::Stamp stamp(std::uint64_t number) {
  msg::Stamp made;
  made.sequence_number(number);
  made.session(5);
  return made;
}

msg::SlaveState slave_state() {
  msg::SlaveState message;
  message.stamp(stamp(1));
  message.state(msg::LINK_COUPLED);
  message.joint_count(7);
  message.position_rad()[2] = 0.5;
  message.contact_force_N(-1);
  return message;
}

/// Whether a message is refused after `change`.
template <class T, class Change>
bool refused(T message, Change change) {
  change(message);
  if constexpr (requires { convert(message, kShape); }) {
    return !convert(message, kShape).has_value();
  } else {
    return !convert(message).has_value();
  }
}

TEST(Conversion, SlaveState) {
  const auto sample = convert(slave_state(), kShape);
  ASSERT_TRUE(sample);
  EXPECT_EQ(sample->state, LinkState::kCoupled);
  EXPECT_EQ(sample->position[2], 0.5);
  const auto fails = [](auto change) { return refused(slave_state(), change); };
  EXPECT_TRUE(fails([](auto& m) { m.stamp(stamp(0)); }));
  EXPECT_TRUE(fails([](auto& m) { m.joint_count(6); }));
  EXPECT_TRUE(fails([](auto& m) { m.joint_count(1000); }));
  EXPECT_TRUE(fails([](auto& m) { m.position_rad()[6] = kNan; }));
  EXPECT_TRUE(fails([](auto& m) { m.velocity_rad_s()[0] = -INFINITY; }));
  EXPECT_TRUE(fails([](auto& m) { m.tool_speed_m_s(kNan); }));
  EXPECT_TRUE(fails([](auto& m) { m.contact_point_m().x(kNan); }));
  EXPECT_TRUE(fails([](auto& m) { m.state(static_cast<msg::LinkState>(6)); }));
}

TEST(Conversion, MasterState) {
  msg::MasterState message;
  message.stamp(stamp(1));
  message.joint_count(7);
  message.percept_gain(1.5);
  message.round_trip_s(-1);
  ASSERT_TRUE(convert(message, kShape));
  EXPECT_EQ(convert(message, kShape)->percept_gain, 1.5);
  const auto fails = [&message](auto change) { return refused(message, change); };
  EXPECT_TRUE(fails([](auto& m) { m.joint_count(8); }));
  EXPECT_TRUE(fails([](auto& m) { m.percept_torque_Nm()[3] = kNan; }));
  EXPECT_TRUE(fails([](auto& m) { m.percept_gain(-0.1); }));
  EXPECT_TRUE(fails([](auto& m) { m.feedback_gain(kNan); }));
  EXPECT_TRUE(fails([](auto& m) { m.law(static_cast<msg::BilateralLaw>(5)); }));
  EXPECT_TRUE(fails([](auto& m) { m.round_trip_s(INFINITY); }));
}

TEST(Conversion, Percept) {
  msg::Percept message;
  message.stamp(stamp(1));
  message.joint_count(7);
  message.valid(true);
  message.closeness(0.5);
  message.link(7);
  ASSERT_TRUE(convert(message, kShape));
  EXPECT_EQ(convert(message, kShape)->link, 7U);
  const auto fails = [&message](auto change) { return refused(message, change); };
  EXPECT_TRUE(fails([](auto& m) { m.closeness(1.01); }));
  EXPECT_TRUE(fails([](auto& m) { m.closeness(kNan); }));
  EXPECT_TRUE(fails([](auto& m) { m.mu(-1); }));
  EXPECT_TRUE(fails([](auto& m) { m.link(8); }));
  EXPECT_TRUE(fails([](auto& m) { m.pgv().z(kNan); }));
  EXPECT_TRUE(fails([](auto& m) { m.position_m().x(1e9); }));
  EXPECT_TRUE(fails([](auto& m) { m.motion(static_cast<msg::MotionClass>(9)); }));
}

TEST(Conversion, HitAlert) {
  msg::HitAlert message;
  message.stamp(stamp(1));
  message.alert(3);
  message.rule(msg::HIT_FAR_NEARING);
  message.link(2);
  message.link_name("forearm");
  message.look_at_m().y(0.4);
  const auto sample = convert(message, kShape);
  ASSERT_TRUE(sample);
  EXPECT_EQ(sample->rule, HitRule::kFarNearing);
  EXPECT_EQ(sample->link_name, "forearm");
  EXPECT_EQ(sample->look_at_m[1], 0.4);
  const auto fails = [&message](auto change) { return refused(message, change); };
  EXPECT_TRUE(fails([](auto& m) { m.alert(0); }));
  EXPECT_TRUE(fails([](auto& m) { m.link(20); }));
  EXPECT_TRUE(fails([](auto& m) { m.look_at_m().x(kNan); }));
  EXPECT_TRUE(fails([](auto& m) { m.speed_m_s(kNan); }));
}

TEST(Conversion, WorkspaceObject) {
  msg::WorkspaceObject message;
  message.id(4);
  message.name("vice");
  message.mesh_hash(99);
  message.X_WO().qw(1);
  message.red(0.5F);
  ASSERT_TRUE(convert(message));
  EXPECT_TRUE(convert(message)->X_WO.rotation.isIdentity());
  const auto fails = [&message](auto change) { return refused(message, change); };
  EXPECT_TRUE(fails([](auto& m) { m.id(0); }));
  EXPECT_TRUE(fails([](auto& m) { m.id(65535); }));
  EXPECT_TRUE(fails([](auto& m) { m.X_WO().qw(0); }));
  EXPECT_TRUE(fails([](auto& m) { m.X_WO().qw(2); }));
  EXPECT_TRUE(fails([](auto& m) { m.X_WO().qx(kNan); }));
  EXPECT_TRUE(fails([](auto& m) { m.X_WO().position_m().z(kNan); }));
  EXPECT_TRUE(fails([](auto& m) { m.green(1.5F); }));
  EXPECT_TRUE(fails([](auto& m) { m.blue(std::nanf("")); }));
}

TEST(Conversion, WorkspaceVersion) {
  msg::WorkspaceVersion message;
  message.version(3);
  message.voxel_size_m(0.005);
  ASSERT_TRUE(convert(message));
  EXPECT_EQ(convert(message)->voxel_size_m, 0.005);
  EXPECT_TRUE(refused(message, [](auto& m) { m.version(0); }));
  EXPECT_TRUE(refused(message, [](auto& m) { m.voxel_size_m(0); }));
  EXPECT_TRUE(refused(message, [](auto& m) { m.voxel_size_m(kNan); }));
}

TEST(Conversion, SkinPercept) {
  msg::SkinPercept message;
  message.stamp(stamp(1));
  message.valid(true);
  message.patch_m(0.02);
  message.greatest_mu(32);
  message.felt().resize(2);
  message.felt()[0].link(7);
  message.felt()[0].mu(8);
  message.felt()[1].mu(100);  // the object's skin: closer than the closest layer
  const auto sample = convert(message, kShape);
  ASSERT_TRUE(sample);
  EXPECT_TRUE(sample->valid);
  ASSERT_EQ(sample->felt.size(), 2U);
  EXPECT_EQ(sample->felt[0].link, 7U);
  EXPECT_EQ(sample->felt[0].closeness, 0.25F);
  EXPECT_EQ(sample->felt[1].closeness, 1.0F);
  const auto fails = [&message](auto change) { return refused(message, change); };
  EXPECT_TRUE(fails([](auto& m) { m.felt()[0].link(8); }));
  EXPECT_TRUE(fails([](auto& m) { m.felt()[1].mu(-1); }));
  EXPECT_TRUE(fails([](auto& m) { m.felt()[1].x_m(std::nanf("")); }));
  EXPECT_TRUE(fails([](auto& m) { m.patch_m(0); }));
  EXPECT_TRUE(fails([](auto& m) { m.greatest_mu(kNan); }));
  message.valid(false);
  EXPECT_FALSE(convert(message, kShape)->valid);
  EXPECT_TRUE(convert(message, kShape)->felt.empty());
}

TEST(Conversion, MeshChunk) {
  msg::MeshChunk message;
  message.chunk_count(2);
  message.vertex_count(3);
  message.triangle_count(1);
  message.data({1, 2, 3});
  EXPECT_TRUE(convert(message));
  EXPECT_TRUE(refused(message, [](auto& m) { m.chunk(2); }));
  EXPECT_TRUE(refused(message, [](auto& m) { m.data({}); }));
}

TEST(Conversion, ComponentStatus) {
  msg::ComponentStatus message;
  message.stamp(stamp(1));
  message.component_name("slave_io");
  message.state(msg::COMPONENT_RUNNING);
  message.loops().resize(1);
  message.loops()[0].rate_hz(999);
  message.topics().resize(2);
  message.topics()[0].refused(2);
  message.topics()[1].refused(3);
  const auto sample = convert(message);
  ASSERT_TRUE(sample);
  EXPECT_EQ(sample->refused, 5U);
  EXPECT_EQ(sample->loops.at(0).rate_hz, 999);
  EXPECT_TRUE(refused(message, [](auto& m) { m.component_name(""); }));
  EXPECT_TRUE(refused(message, [](auto& m) { m.loops()[0].wakeup_max_us(kNan); }));
  EXPECT_TRUE(refused(message, [](auto& m) { m.state(static_cast<msg::ComponentState>(77)); }));
}

TEST(Conversion, OperatorCommand) {
  msg::OperatorCommand message;
  message.stamp(stamp(1));
  message.kind(msg::COMMAND_VIEW_NODE);
  message.value(9);
  ASSERT_TRUE(convert(message));
  EXPECT_EQ(convert(message)->kind, CommandKind::kViewNode);
  EXPECT_TRUE(refused(message, [](auto& m) { m.value(15); }));
  EXPECT_TRUE(refused(message, [](auto& m) { m.value(kNan); }));
  EXPECT_TRUE(refused(message, [](auto& m) { m.kind(static_cast<msg::CommandKind>(7)); }));
}

using dds::eventually;
using dds::test_network;

class Adapter : public ::testing::Test {
 protected:
  Inbox inbox_;
  DdsAdapter adapter_{test_network(), kShape, inbox_};
  dds::Participant other_{"other", test_network()};
  std::deque<Event> events_;  // all that came so far

  template <class T>
  std::vector<T> got() {
    for (Event& event : inbox_.take_events()) events_.push_back(std::move(event));
    std::vector<T> found;
    for (const Event& event : events_) {
      if (const T* wanted = std::get_if<T>(&event)) found.push_back(*wanted);
    }
    return found;
  }
};

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
  ASSERT_TRUE(eventually([&] { return got<ObjectGone>().size() == 1; }));
  EXPECT_EQ(got<ObjectGone>()[0].id, 7);
}

TEST_F(Adapter, AlertsArriveInOrderAndComponentsByName) {
  dds::Writer<msg::HitAlert> writer(other_, dds::kHitAlert);
  dds::StatusReporter reporter(other_);
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
      if (component.name == "other") return true;
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
  const auto tell = [&](double value) {
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
  tell(0.25);
  raise(2);
  tell(0.75);
  const auto hits = got<HitSample>();
  ASSERT_EQ(hits.size(), 2U);
  EXPECT_EQ(hits[0].arm.received_ns, 0) << "there was none yet";
  EXPECT_EQ(hits[1].arm.position[0], 0.25);
  EXPECT_EQ(hits[1].percept.closeness, 0.25);
  EXPECT_GT(hits[1].arm.received_ns, 0);
}

TEST_F(Adapter, ItsCommandsReachOthersAndItself) {
  dds::Waiter waiter;
  std::vector<msg::OperatorCommand> heard;
  dds::Reader<msg::OperatorCommand> reader(other_, dds::kOperatorCommand,
                                           [&](const msg::OperatorCommand& command, const dds::SampleInfo&) {
                                             waiter.change([&] { heard.push_back(command); });
                                           });
  ASSERT_TRUE(eventually([&] { return reader.matched() >= 1; }));
  ASSERT_TRUE(eventually([&] {
    EXPECT_TRUE(adapter_.send({CommandKind::kViewNode, 13}).is_ok());
    return waiter.wait([&] { return !heard.empty(); }, std::chrono::seconds(1));
  }));
  EXPECT_EQ(heard[0].kind(), msg::COMMAND_VIEW_NODE);
  EXPECT_EQ(heard[0].value(), 13);
  EXPECT_GT(heard[0].stamp().sequence_number(), 0U);
  ASSERT_TRUE(eventually([&] { return !got<Command>().empty(); }));
  EXPECT_EQ(got<Command>()[0].value, 13);
}

TEST(InboxQueue, IsBoundedAndCountsWhatItLoses) {
  Inbox inbox;
  for (int k = 0; k < 20000; ++k) inbox.put(ObjectGone{1});
  EXPECT_EQ(inbox.take_events().size() + inbox.lost(), 20000U);
  EXPECT_GT(inbox.lost(), 0U);
  EXPECT_TRUE(inbox.put(ObjectGone{1}));
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

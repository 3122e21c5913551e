// What the adapter refuses, what it sends, and the component over a real data space.
#include "components/phantom_sensing/dds_adapter.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <mutex>
#include <numeric>
#include <random>
#include <sstream>
#include <thread>
#include <vector>

#include "common/core/log_rate.hpp"
#include "common/dds/endpoints/endpoint.hpp"
#include "common/dds/tests/test_network.hpp"
#include "common/messages/codecs/percept_codec.hpp"
#include "common/messages/codecs/teleoperation_codec.hpp"
#include "common/messages/codecs/workspace_codec.hpp"
#include "common/messages/publisher.hpp"
#include "common/workspace/brick_codec.hpp"
#include "components/phantom_sensing/dds_adapter_messages.hpp"
#include "components/phantom_sensing/tests/rig.hpp"
#include "components/phantom_sensing/tests/server.hpp"
#include "tests/support/captured_log.hpp"
#include "tests/support/child_process.hpp"

namespace phantom::phantom_sensing {
namespace {

using testing::HasSubstr;

msg::SlaveState good_state(const robot::SerialArm& arm) {
  msg::SlaveState state;
  state.stamp().sequence_number(9);
  state.stamp().monotonic_ns(12345);
  state.stamp().session(4);
  state.master_echo().sequence_number(8);
  state.joint_count(static_cast<std::uint32_t>(arm.joint_count()));
  state.position_rad()[0] = 0.2;
  state.velocity_rad_s()[0] = 0.3;
  return state;
}

TEST(Messages, SayWhatTheStepGave) {
  const PhantomModel model = rig::suspended_model();
  PhantomSensing sensing(model, {});
  StepOutputs out;
  sensing.step(rig::hanging(0.2, 0.3), out);
  const auto state = messages::from_idl(good_state(model.arm), messages::bounds_of(model.arm));
  ASSERT_TRUE(state);
  TickInfo info{{*state, 777}, 0.001, 20e-6};
  info.gripper = {11, 98, 76};
  msg::DragField drag = messages::to_idl(drag_field_of(out, info, 7));
  EXPECT_TRUE(drag.valid());
  EXPECT_EQ(drag.slave_echo().sequence_number(), 9U);
  EXPECT_EQ(drag.slave_echo().monotonic_ns(), 12345);
  EXPECT_EQ(drag.master_echo().sequence_number(), 8U);
  EXPECT_EQ(drag.gripper_echo().sequence_number(), 11U);
  EXPECT_EQ(drag.gripper_echo().session(), 76U);
  EXPECT_EQ(drag.joint_count(), 7U);
  EXPECT_EQ(drag.coefficient_plus(), out.drag.plus);
  EXPECT_EQ(drag.coupled(), out.drag.coupled);
  EXPECT_EQ(drag.mode(), msg::DragMode::DRAG_SEPARABLE);
  PerceptSettings coupled_settings;
  coupled_settings.mode = robot::DragMode::kCoupled;
  StepOutputs coupled;
  PhantomSensing(model, coupled_settings).step(rig::hanging(0.2, 0.3), coupled);
  drag = messages::to_idl(drag_field_of(coupled, info, 7));
  EXPECT_EQ(drag.mode(), msg::DragMode::DRAG_COUPLED);
  EXPECT_EQ(drag.workspace_version(), 1U);
  const msg::Percept percept = messages::to_idl(percept_of(out, info, 7));
  EXPECT_EQ(percept.mu(), out.percept.mu);
  EXPECT_EQ(percept.motion(), msg::MotionClass::MOTION_DANGEROUS);
  EXPECT_EQ(percept.object(), 1);
  EXPECT_DOUBLE_EQ(percept.speed_m_s(), 0.3);
  EXPECT_EQ(percept.drag_torque_Nm(), out.percept.drag_torque);
  ASSERT_FALSE(out.alerts.raised.empty());
  ASSERT_EQ(percept.threats().size(), out.threats.size());
  EXPECT_EQ(percept.threats()[0].link(), out.percept.link) << "the most urgent leads";
  EXPECT_EQ(percept.threats()[0].time_to_contact_s(), out.threats[0].contact.time_s);
  EXPECT_EQ(percept.greatest_mu(), out.worst.mu);
  const msg::HitAlert alert = messages::to_idl(hit_alert_of(out.alerts.raised.back(), false, model));
  EXPECT_EQ(alert.alert(), out.alerts.raised.size());
  EXPECT_EQ(alert.rule(), msg::HitRule::HIT_MODERATE_MOVING);
  EXPECT_EQ(alert.link_name().to_string(), model.arm.links()[alert.link()].name);
  EXPECT_FALSE(alert.cleared());
  EXPECT_EQ(alert.time_to_contact_s(), out.threats[0].contact.time_s);
  EXPECT_GT(alert.time_to_contact_s(), 0.0);
}

// Tries phantom_sensing: a command that cannot be carried out
TEST(OverDds, CommandsAreCarriedOutOnceAndAnsweredEachTime) {
  const core::NetworkOptions network = dds::test_network();
  const PhantomModel model = rig::suspended_model();
  const Config config;
  DdsAdapter adapter(network, model);
  WorkspaceSubscriber keeper({[](const std::string&) {}});
  SensingLoop loop(model, config, keeper, adapter);
  adapter.start_reading(loop, keeper);
  EXPECT_FALSE(adapter.workspace_attended());

  dds::Participant outside("outside", network);
  dds::Writer<msg::SensingCommand> commands(outside, dds::kSensingCommand);
  dds::Writer<msg::WorkspaceObject> objects(outside, dds::kWorkspaceObject);
  dds::Writer<msg::WorkspaceVersion> versions(outside, dds::kWorkspaceVersion);
  std::mutex mutex;
  std::map<std::uint64_t, std::vector<msg::SensingReply>> replies;  // by the command's number
  dds::Reader<msg::SensingReply> reader(outside, dds::kSensingReply,
                                        [&](const msg::SensingReply& reply, const dds::SampleInfo&) {
                                          const std::lock_guard lock(mutex);
                                          replies[reply.command().sequence_number()].push_back(reply);
                                        });
  EXPECT_TRUE(dds::eventually([&] { return adapter.workspace_attended(); }));
  EXPECT_TRUE(dds::eventually([&] { return commands.matched() > 0 && reader.matched() > 0; }));
  msg::WorkspaceObject vice;
  vice.id(3);
  vice.name("vice");
  vice.mesh_hash(77);
  vice.X_WO().qw(1);
  objects.write(vice);
  EXPECT_TRUE(dds::eventually([&] { return adapter.objects().size() == 1; }));
  EXPECT_EQ(adapter.objects().at(3).name, "vice");

  int carried_out = 0, tests = 0;
  msg::SensingCommand command;
  const auto replies_now = [&] {
    adapter.handle_commands([&](const messages::SensingCommand& request) -> Answer {
      if (request.request == messages::SensingRequest::kListContacts) return {true, "allowed: vice by hand"};
      if (request.request == messages::SensingRequest::kSelfTest) {
        ++tests;
        return {false, "broken"};
      }
      ++carried_out;
      EXPECT_EQ(request.request, messages::SensingRequest::kAllowContact);
      EXPECT_EQ(request.object, "vice");
      EXPECT_EQ(request.link, "hand");
      EXPECT_EQ(request.duration_s, 2.5);
      return {true, "so be it"};
    });
    const std::lock_guard lock(mutex);
    return replies[command.stamp().sequence_number()].size();
  };
  const auto reply = [&] {
    EXPECT_TRUE(dds::eventually([&] { return replies_now() > 0; }));
    const std::lock_guard lock(mutex);
    const auto& to_this = replies[command.stamp().sequence_number()];
    return to_this.empty() ? msg::SensingReply() : to_this.back();
  };
  dds::Stamper stamper(outside);
  command.stamp(stamper.next());
  command.requester("test");
  command.request(msg::SensingRequest::SENSING_ALLOW_CONTACT);
  command.object("vice");
  command.link("hand");
  command.duration_s(2.5);
  // Sent again and again, as if its replies had been lost: the first are, while an end does not know the
  // other.
  ASSERT_TRUE(dds::eventually([&] {
    commands.write(command);
    return replies_now() >= 2;
  }));
  EXPECT_EQ(carried_out, 1);
  EXPECT_TRUE(reply().done());
  EXPECT_EQ(reply().message().to_string(), "so be it");
  command.stamp(stamper.next());
  command.request(msg::SensingRequest::SENSING_SELF_TEST);
  commands.write(command);
  EXPECT_FALSE(reply().done());
  EXPECT_EQ(reply().requester().to_string(), "test");
  EXPECT_EQ(tests, 1);
  command.stamp(stamper.next());
  command.request(msg::SensingRequest::SENSING_LIST_CONTACTS);
  commands.write(command);
  EXPECT_EQ(reply().message().to_string(), "allowed: vice by hand");
  command.stamp(stamper.next());
  command.request(static_cast<msg::SensingRequest>(17));  // of a newer version than ours
  commands.write(command);
  EXPECT_FALSE(reply().done());
  EXPECT_THAT(reply().message().to_string(), HasSubstr("request is 17; allowed: "));
  EXPECT_EQ(carried_out, 1);
  adapter.stop_reading();
}

// Tries phantom_sensing: a second process sends `slave_state`
TEST(OverDds, ASecondSlaveIsToldInTheStatus) {
  const core::NetworkOptions network = dds::test_network();
  const PhantomModel model = rig::suspended_model();
  const Config config;
  DdsAdapter adapter(network, model);
  WorkspaceSubscriber keeper({[](const std::string&) {}});
  SensingLoop loop(model, config, keeper, adapter);
  adapter.start_reading(loop, keeper);

  dds::Participant first("first", network), second("second", network);
  dds::Writer<msg::SlaveState> first_writer(first, dds::kSlaveState), second_writer(second, dds::kSlaveState);
  dds::Stamper first_stamper(first), second_stamper(second);
  std::atomic<bool> sound{false}, reported{false};
  dds::Reader<msg::ComponentStatus> status(
      first, dds::kComponentStatus, [&](const msg::ComponentStatus& s, const dds::SampleInfo&) {
        const bool rival =
            s.state() == msg::ComponentState::COMPONENT_DEGRADED &&
            s.message().to_string().find("two processes send slave_state") != std::string::npos;
        (rival ? reported : sound) = true;
      });
  msg::SlaveState state = good_state(model.arm);
  const auto send = [&](auto& writer, auto& stamper) {
    state.stamp(stamper.next());
    writer.write(state);
    adapter.publish_status({});
  };
  EXPECT_TRUE(dds::eventually([&] {
    send(first_writer, first_stamper);
    return sound.load();
  }));
  EXPECT_FALSE(reported.load());
  EXPECT_TRUE(dds::eventually([&] {
    send(first_writer, first_stamper);
    send(second_writer, second_stamper);
    return reported.load();
  }));
  adapter.stop_reading();
}

TEST(OverDds, APerceptSaysThatNoDepthCameraSeesItsPlace) {
  const core::NetworkOptions network = dds::test_network();
  const PhantomModel model = rig::suspended_model();
  const Config config;
  dds::Participant other("other", network);
  messages::Publisher<messages::SpaceView> views(other, dds::kSpaceView);
  messages::Publisher<messages::SlaveState> slaves(other, dds::kSlaveState);
  std::atomic<msg::PerceptCondition> said{msg::PerceptCondition::PERCEPT_NO_STATE};
  dds::Reader<msg::Percept> percepts(
      other, dds::kPercept,
      [&](const msg::Percept& percept, const dds::SampleInfo&) { said = percept.condition(); });
  DdsAdapter adapter(network, model);
  WorkspaceSubscriber keeper({[](const std::string&) {}});
  SensingLoop loop(model, config, keeper, adapter);
  adapter.start_reading(loop, keeper);
  rig::send(rig::wall(), 1, keeper);
  messages::SpaceView view;
  view.source = "workspace_camera", view.cell = "cell";
  view.origin_m = {-10.0, -10.0, -10.0};
  view.cube_m = 20.0;
  view.size_x = view.size_y = view.size_z = 1;
  const auto says = [&](std::uint8_t age, msg::PerceptCondition condition) {
    return dds::eventually([&] {
      view.ages = {age};
      views.publish(view);
      messages::SlaveState state;
      state.joint_count = 7;
      slaves.publish(state);
      loop.turn(core::monotonic_ns());
      return said == condition;
    });
  };
  EXPECT_TRUE(says(messages::kSpaceNeverSeen, msg::PerceptCondition::PERCEPT_SPACE_UNSEEN));
  loop.workspace_watch().attended(true);
  EXPECT_TRUE(says(1, msg::PerceptCondition::PERCEPT_FRESH));
  adapter.stop_reading();
}

TEST(OverDds, AFindingHoldsWhileItsObjectStandsWhereItStoodThen) {
  const core::NetworkOptions network = dds::test_network();
  const PhantomModel model = rig::suspended_model();
  const Config config;
  dds::Participant other("other", network);
  dds::Writer<msg::WorkspaceObject> objects(other, dds::kWorkspaceObject);
  dds::Writer<msg::PoseFinding> findings(other, dds::kPoseFinding);
  messages::WorkspaceObject drum{.id = 3, .name = "drum", .mesh_hash = 5};
  drum.X_WO.translation_m = {0.4, 0.1, 0.0};
  messages::PoseFinding finding{
      .id = 3, .verdict = messages::PoseVerdict::kElsewhere, .camera = "above", .X_WO = drum.X_WO};
  finding.shift_m = 0.1;
  finding.corrected_WO.translation_m = {0.5, 0.1, 0.0};
  objects.write(messages::to_idl(drum));
  findings.write(messages::to_idl(finding));

  DdsAdapter adapter(network, model);  // joins later
  WorkspaceSubscriber keeper({[](const std::string&) {}});
  SensingLoop loop(model, config, keeper, adapter);
  adapter.start_reading(loop, keeper);
  const auto is_displaced = [&] { return adapter.displaced().contains(3); };
  EXPECT_TRUE(dds::eventually(is_displaced));
  EXPECT_FALSE(adapter.displaced().contains(4));
  drum.X_WO = finding.corrected_WO;  // a person puts it where the camera sees it
  objects.write(messages::to_idl(drum));
  EXPECT_TRUE(dds::eventually([&] { return !is_displaced(); }));
  finding.X_WO = drum.X_WO;
  finding.verdict = messages::PoseVerdict::kGone;
  findings.write(messages::to_idl(finding));
  EXPECT_TRUE(dds::eventually(is_displaced));
  finding.verdict = messages::PoseVerdict::kAgrees;
  findings.write(messages::to_idl(finding));
  EXPECT_TRUE(dds::eventually([&] { return !is_displaced(); }));
  adapter.stop_reading();
}

// Tries phantom_sensing: 64 commands wait
TEST(OverDds, TheSixtyFifthCommandIsRefusedAloud) {
  const core::NetworkOptions network = dds::test_network();
  const PhantomModel model = rig::suspended_model();
  DdsAdapter adapter(network, model);  // and nobody carries out
  dds::Participant outside("outside", network);
  dds::Writer<msg::SensingCommand> commands(outside, dds::kSensingCommand);
  std::mutex mutex;
  std::map<std::uint64_t, std::string> refused;  // by the command's number
  dds::Reader<msg::SensingReply> reader(
      outside, dds::kSensingReply, [&](const msg::SensingReply& reply, const dds::SampleInfo&) {
        if (reply.done()) return;  // those that are carried out in the end
        const std::lock_guard lock(mutex);
        refused[reply.command().sequence_number()] = reply.message().to_string();
      });
  ASSERT_TRUE(dds::eventually([&] { return commands.matched() > 0 && reader.matched() > 0; }));
  msg::SensingCommand command;
  command.request(msg::SensingRequest::SENSING_LIST_CONTACTS);
  command.stamp().session(outside.session());
  const auto send = [&](std::uint64_t number) {
    command.stamp().sequence_number(number);
    commands.write(command);
  };
  // Again and again: the first ones may come before both sides know each other. Whichever comes last of the
  // 65 is refused, always the same one then.
  EXPECT_TRUE(dds::eventually([&] {
    for (std::uint64_t i = 1; i <= 65; ++i) send(i);
    const std::lock_guard lock(mutex);
    return !refused.empty();
  }));
  {
    const std::lock_guard lock(mutex);
    ASSERT_EQ(refused.size(), 1U);
    EXPECT_THAT(refused.begin()->second, HasSubstr("64 commands are waiting already; send it again later"));
  }
  // Carried out at once, they do not fill the log.
  const test::CapturedLog log;
  const core::Nanoseconds begun_ns = core::monotonic_ns();
  int carried_out = 0;
  adapter.handle_commands([&](const messages::SensingCommand&) -> Answer {
    ++carried_out;
    return {true, "no contact"};
  });
  EXPECT_GE(carried_out, 64);
  int lines = 0;
  std::istringstream text(log.text());
  for (std::string line; std::getline(text, line);) lines += line.find("asked: no contact") < line.size();
  const auto periods = (core::monotonic_ns() - begun_ns) / core::LogRate::kPeriod_ns + 1;
  EXPECT_LE(lines, core::LogRate::kBurst * periods);
  EXPECT_GE(lines, core::LogRate::kBurst);
}

/// The component's insides on one side of a data space, a slave, a workspace server and a listener on the
/// other.
// Tries phantom_sensing: no workspace yet; no slave state yet
// Tries phantom_sensing: slave state not finite … out of order
TEST(OverDds, StatesBecomeDragAndBadOnesAreCounted) {
  const core::NetworkOptions network = dds::test_network();
  const PhantomModel model = rig::suspended_model();
  Config config;
  DdsAdapter adapter(network, model);
  WorkspaceSubscriber keeper(adapter.workspace_callbacks());
  SensingLoop loop(model, config, keeper, adapter);
  std::thread thread([&] { loop.run(); });
  adapter.start_reading(loop, keeper);

  dds::Participant outside("outside", network);
  dds::Writer<msg::SlaveState> slave(outside, dds::kSlaveState);
  std::atomic<bool> valid_seen{false}, invalid_seen{false}, alert_raised{false}, alert_cleared{false},
      percept_seen{false};
  std::atomic<std::uint64_t> refused{0};
  dds::Reader<msg::DragField> drag(
      outside, dds::kDragField, [&](const msg::DragField& d, const dds::SampleInfo&) {
        if (d.valid() && d.coefficient_plus()[0] > 0.0 && d.slave_echo().session() == outside.session())
          valid_seen = true;
        if (!d.valid() && d.coefficient_plus()[0] == 0.0) invalid_seen = true;
      });
  dds::Reader<msg::Percept> percept(outside, dds::kPercept,
                                    [&](const msg::Percept& p, const dds::SampleInfo&) {
                                      if (p.valid() && p.mu() > 0.0) percept_seen = true;
                                    });
  dds::Reader<msg::HitAlert> hits(outside, dds::kHitAlert,
                                  [&](const msg::HitAlert& h, const dds::SampleInfo&) {
                                    (h.cleared() ? alert_cleared : alert_raised) = true;
                                  });
  dds::Reader<msg::ComponentStatus> status(outside, dds::kComponentStatus,
                                           [&](const msg::ComponentStatus& s, const dds::SampleInfo&) {
                                             for (const auto& topic : s.topics()) {
                                               if (topic.topic().to_string() == "slave_state")
                                                 refused = topic.refused();
                                             }
                                           });

  EXPECT_TRUE(dds::eventually([&] { return invalid_seen.load(); })) << "invalid results from the start on";
  const rig::Server server(network, 1, "wall");

  dds::Stamper stamper(outside);
  msg::SlaveState state = good_state(model.arm);
  const auto send = [&] {
    state.stamp(stamper.next());
    slave.write(state);
  };
  EXPECT_TRUE(dds::eventually([&] {
    send();
    return valid_seen && percept_seen && alert_raised;
  }));
  const auto expect_refused = [&](auto damage) {
    state = good_state(model.arm);
    damage(state);
    const std::uint64_t before = refused;
    EXPECT_TRUE(dds::eventually([&] {
      if (state.stamp().sequence_number() == 1) {
        slave.write(state);
      } else {
        send();
      }
      adapter.publish_status({});
      return refused >= before + 3;
    }));
  };
  expect_refused([](auto& s) { s.position_rad()[2] = std::nan(""); });
  expect_refused([&](auto& s) {
    s.stamp(stamper.next());
    s.stamp().sequence_number(1);  // out of order
  });
  invalid_seen = false;  // bad states count for nothing: the last good one grows stale
  EXPECT_TRUE(dds::eventually([&] { return invalid_seen && alert_cleared; }));

  adapter.stop_reading();
  loop.stop();
  thread.join();
}

}  // namespace
}  // namespace phantom::phantom_sensing

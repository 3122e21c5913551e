#include "components/phantom_session/collector.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace phantom::phantom_session {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;

messages::MasterState master(int reach, bool percept, double torque_Nm) {
  messages::MasterState state;
  state.reach = reach;
  state.percept_enabled = percept;
  state.percept_torque_Nm[2] = -torque_Nm;  // the greatest magnitude counts
  return state;
}
messages::SlaveState slave(double clearance_m, double speed_m_s, bool contact = false, int object = 0) {
  messages::SlaveState state;
  state.contact = contact;
  state.contact_object = static_cast<std::uint16_t>(object);
  state.tool_speed_m_s = speed_m_s;
  state.clearance_m = clearance_m;
  return state;
}

TEST(Collector, FindsOnsetPeakAndContactOfEachReach) {
  std::vector<std::string> lines;
  Collector collector(0.05, 0.001, [&](const std::string& line) { lines.push_back(line); });
  collector.on_object_name(4, "gate_valve");
  for (int i = 0; i <= 100; ++i) {  // closing in at 100 mm/s from 100 mm; torque rises as distance falls
    const double t_s = 0.01 * i, clearance_m = 0.1 - 0.001 * i;
    collector.on_slave(t_s, slave(clearance_m, 0.1, i == 100, i == 100 ? 4 : 0));
    collector.on_master(t_s, master(0, true, clearance_m > 0.06 ? 0.0 : 1.0 - 10 * clearance_m));
  }
  collector.on_master(1.01, master(0, true, 9.0));  // after the contact: no percept figure any more
  ASSERT_EQ(collector.reaches().size(), 1u);
  const Reach& reach = collector.reaches()[0];
  ASSERT_TRUE(reach.onset_distance_m);
  EXPECT_NEAR(*reach.onset_distance_m, 0.06, 0.0011);
  ASSERT_TRUE(reach.contact_s);
  EXPECT_NEAR(*reach.contact_s, 1.0, 1e-9);
  EXPECT_NEAR(reach.contact_speed_m_s, 0.1, 1e-9);
  EXPECT_NEAR(reach.peak_torque_Nm, 0.99, 0.011);
  EXPECT_THAT(lines, Contains(HasSubstr("contact with gate_valve at 100 mm/s")));
}

TEST(Collector, WithoutPerceptThereIsNoOnsetButAContactSpeed) {
  Collector collector(0.05, 0.001, {});
  collector.on_master(0, master(3, false, 0.0));
  collector.on_slave(0.1, slave(0.01, 0.2));
  collector.on_slave(0.2, slave(0.0, 0.05, true, 2));
  collector.on_slave(0.3, slave(0.01, 0.1));
  collector.on_slave(0.4, slave(0.0, 0.7, true, 2));  // bounces: the first contact counts
  ASSERT_EQ(collector.reaches().size(), 1u);
  EXPECT_FALSE(collector.reaches()[0].onset_distance_m);
  EXPECT_EQ(collector.reaches()[0].peak_torque_Nm, 0.0);
  EXPECT_NEAR(collector.reaches()[0].contact_speed_m_s, 0.2, 1e-9);
}

TEST(Collector, RowsKeepTheirInterval) {
  Collector collector(0.05, 0.01, {});
  for (int i = 0; i < 1000; ++i) collector.on_slave(0.001 * i, slave(0.1, 0));
  EXPECT_NEAR(static_cast<double>(collector.rows().size()), 100.0, 10.0);
}

TEST(Collector, OnlyRaisedHitsCount) {
  Collector collector(0.05, 0.01, {});
  collector.on_hit({.t_s = 1, .alert = 1, .rule = "very close", .link = "forearm", .object = 9});
  collector.on_hit({.t_s = 2, .alert = 1, .cleared = true});
  ASSERT_EQ(collector.hits().size(), 1u);
  EXPECT_EQ(collector.object_name(9), "object 9") << "a name that never came is told as a number";
  EXPECT_EQ(collector.object_name(65'000), "another arm")
      << "which the phantom feels beside the cell's objects";
}

TEST(Collector, AHitThatSkinAndInterestPointTellIsOneLineAndLinesKeepTheirOrder) {
  std::vector<std::string> lines;
  Collector collector(0.05, 0.01, [&](const std::string& line) { lines.push_back(line); });
  collector.on_object_name(4, "pump");
  const auto hit = [&](double t_s, const char* link, const char* point, const char* rule = "nearing fast") {
    collector.on_hit({.t_s = t_s, .rule = rule, .link = link, .point = point, .object = 4});
  };
  hit(1.00, "forearm", "");
  collector.on_master(1.05, master(0, true, 0.0));
  hit(1.06, "forearm", "elbow");
  collector.on_slave(1.24, slave(0.1, 0.2));
  EXPECT_EQ(lines.size(), 0u) << "it may go on";
  collector.on_slave(1.26, slave(0.1, 0.2));
  hit(2.0, "wrist", "wrist");
  hit(2.1, "wrist", "wrist", "very close");
  hit(2.2, "gripper", "");
  hit(2.3, "wrist", "");
  hit(3.0, "wrist", "");
  EXPECT_EQ(lines.size(), 6u);
  collector.narrate_rest();
  EXPECT_THAT(lines, ElementsAre("   1.00 s    hit threatens: forearm (skin, elbow) near pump (nearing fast)",
                                 "   1.05 s  reach 0 begins, percept on, but nothing is sensed yet",
                                 "   2.00 s    hit threatens: wrist (wrist) near pump (nearing fast)",
                                 "   2.10 s    hit threatens: wrist (wrist) near pump (very close)",
                                 "   2.20 s    hit threatens: gripper near pump (nearing fast)",
                                 "   2.30 s    hit threatens: wrist near pump (nearing fast)",
                                 "   3.00 s    hit threatens: wrist near pump (nearing fast)"));
  EXPECT_EQ(collector.hits().size(), 7u) << "the report has all";
}

// Tries phantom_session: a component is not ready
TEST(Collector, ReadinessNamesWhoIsMissing) {
  Collector collector(0.05, 0.01, {});
  std::string missing;
  collector.on_status({.component = "slave_io", .state = core::ComponentState::kRunning});
  collector.on_status({.component = "master_io", .state = core::ComponentState::kDegraded});
  EXPECT_FALSE(collector.all_ready({"slave_io", "master_io", "wva_server"}, &missing));
  EXPECT_EQ(missing, "master_io, wva_server");
  EXPECT_TRUE(collector.all_ready({"slave_io"}, &missing));
  EXPECT_FALSE(collector.any_stopped());
  collector.on_status({.component = "master_io", .state = core::ComponentState::kStopped});
  EXPECT_TRUE(collector.any_stopped());
}

TEST(Collector, KnowsTheOperatorsPageFromWhoServesIt) {
  Collector collector(0.05, 0.01, {});
  collector.on_status({.component = "slave_io"});
  EXPECT_EQ(collector.page(), "");
  collector.on_status({.component = "synthetic_viewer", .page = "http://127.0.0.1:8080/"});
  collector.on_status({.component = "wva_server"});
  EXPECT_EQ(collector.page(), "http://127.0.0.1:8080/");
}

TEST(Collector, TellsMessagesAtOnceButProgressOfAStartNowAndThen) {
  std::vector<std::string> lines;
  Collector collector(0.05, 0.01, [&](const std::string& line) { lines.push_back(line); });
  for (int i = 0; i <= 50; ++i) {
    collector.on_status({.t_s = 0.1 * i,
                         .component = "wva_server",
                         .state = core::ComponentState::kStarting,
                         .message = "activated " + std::to_string(i) + " of 50"});
  }
  EXPECT_EQ(lines.size(), 3u);
  collector.on_status(
      {.t_s = 5.05, .component = "wva_server", .state = core::ComponentState::kRunning, .message = "ready"});
  collector.on_status(
      {.t_s = 5.1, .component = "wva_server", .state = core::ComponentState::kRunning, .message = "ready"});
  EXPECT_EQ(lines.size(), 4u) << "the same message is told once";
}

// Tries phantom_session: names, reaches and hits without end
TEST(Collector, InventedComponentsReachesAndHitsDoNotMakeItGrow) {
  Collector collector(0.05, 1.0, {});
  StatusSample status;
  for (int i = 0; i < 5'000; ++i) {
    status.component = "invented_" + std::to_string(i);
    status.message = "is here";
    status.t_s = 1e-3 * i;
    collector.on_status(status);
    ASSERT_LE(collector.statuses().size(), Collector::kMaxComponents);
  }
  EXPECT_TRUE(collector.statuses().contains("invented_4999"));
  for (int i = 0; i < static_cast<int>(Collector::kMaxEvents) + 100; ++i) {
    collector.on_master(5.0 + 1e-3 * i, master(i, false, 0.0));
    collector.on_master(5.0 + 1e-3 * i, master(i, false, 0.0));  // a state of the same reach
    collector.on_hit({.t_s = 5.0 + 1e-3 * i, .alert = static_cast<std::uint32_t>(i)});
  }
  EXPECT_EQ(collector.reaches().size(), Collector::kMaxEvents);
  EXPECT_EQ(collector.hits().size(), Collector::kMaxEvents);
  EXPECT_EQ(collector.forgotten().components, 5000 - Collector::kMaxComponents);
  EXPECT_EQ(collector.forgotten().reaches, 100U);
  EXPECT_EQ(collector.forgotten().hits, 100U);
}

}  // namespace
}  // namespace phantom::phantom_session

// The recorder's files, read by other people's tools.
#include "tests/recording/recorded.hpp"

namespace phantom::recorder_process {
namespace {

class OtherReaders : public Recorded {};

TEST_F(OtherReaders, FindTheSameSamplesAndDecodeThemByTheSchemasInTheFile) {
  Process recorder(command("record", {"--folder", (folder / "out").string()}), folder / "record.log");
  dds::Participant there("phantom_sensing", test_network());
  dds::Writer<msg::HitAlert> alerts(there, dds::kHitAlert);
  dds::Writer<msg::SlaveState> states(there, dds::kSlaveState);
  dds::Writer<msg::DragField> fields(there, dds::kDragField);
  dds::Writer<msg::WorkspaceBrick> bricks(there, dds::kWorkspaceBrick);
  dds::Writer<msg::WorkspaceVersion> versions(there, dds::kWorkspaceVersion);
  dds::Writer<msg::InterestPoints> points(there, dds::kInterestPoints);
  ASSERT_TRUE(eventually(
      [&] {
        return alerts.matched() > 0 && states.matched() > 0 && fields.matched() > 0 && points.matched() > 0 &&
               bricks.matched() > 0 && versions.matched() > 0;
      },
      std::chrono::seconds(60)))
      << recorder.output();
  dds::Stamper stamper(there);
  for (int i = 1; i <= 200; ++i) {
    msg::SlaveState state;
    state.stamp(stamper.next());
    state.joint_count(7);
    for (std::size_t j = 0; j < 7; ++j) state.position_rad()[j] = 0.1 * i + static_cast<double>(j);
    state.contact(i % 2 == 0);
    states.write(state);
    msg::DragField field;
    field.stamp(stamper.next());
    for (std::size_t j = 0; j < 136; ++j) field.coupled()[j] = 1.0 / (1.0 + static_cast<double>(j) + i);
    fields.write(field);
    msg::InterestPoints sensed;
    sensed.stamp(stamper.next());
    sensed.condition(msg::PerceptCondition::PERCEPT_WORKSPACE_BEHIND);
    sensed.points().resize(static_cast<std::size_t>(i % 4));
    for (auto& point : sensed.points()) point.name("elbow"), point.mu(0.5 * i);
    points.write(sensed);
    if (i % 10 == 0) {
      msg::HitAlert alert;
      alert.stamp(stamper.next());
      alert.alert(static_cast<std::uint32_t>(i));
      alert.rule(msg::HitRule::HIT_FAR_NEARING);
      alert.link_name("gripper");
      alerts.write(alert);
      msg::WorkspaceBrick brick;
      brick.bx(i);
      brick.voxels_zstd(std::vector<std::uint8_t>(static_cast<std::size_t>(i), 7));
      bricks.write(brick);
      // What is best effort waits for nobody: not more of it than the recorder keeps up with.
      ASSERT_TRUE(eventually([&] { return last_alert_in(folder / "out") == i; })) << recorder.output();
    }
  }
  msg::WorkspaceVersion version;
  version.cell("hot_cell");
  version.version(3);
  version.palette({0.0F, 9.0F, 32.0F});
  version.content_hash(0xfedcba9876543210U);
  versions.write(version);
  ASSERT_TRUE(eventually([&] {
    const auto recorded = topics_in(folder / "out");
    return recorded.contains("workspace_version") && recorded.contains("component_status");
  })) << recorder.output();
  ASSERT_EQ(recorder.end(SIGINT), 0) << recorder.output();

  const auto files = files_in(folder / "out");
  ASSERT_EQ(files.size(), 1u);
  EXPECT_TRUE(recording::check(files[0])->ok());
  std::string output;
  ASSERT_EQ(run("convert", {files[0].string(), "--out", (folder / "out.jsonl").string()}, &output), 0)
      << output;
  setenv("READERS", PHANTOM_READERS, 1);
  Process reader({PHANTOM_NODE, PHANTOM_SOURCE_DIR "/tests/recording/read_recording.mjs", files[0].string(),
                  (folder / "out.jsonl").string()},
                 folder / "node.log");
  ASSERT_EQ(reader.wait(), 0) << reader.output();
  const auto report = nlohmann::json::parse(reader.output());
  EXPECT_GT(report["samples"], 300);
  EXPECT_GT(report["numbers"], 20'000);
  EXPECT_EQ(report["attachments"], 2);
  for (const char* topic : {"hit_alert", "slave_state", "drag_field", "interest_points", "workspace_brick",
                            "workspace_version", "component_status"})
    EXPECT_THAT(report["topics"].dump(), HasSubstr(topic));
}

TEST_F(OtherReaders, DecodeTheBagOfRos2AndFindTheValuesThatWereRecorded) {
  Process recorder(command("record", {"--folder", (folder / "out").string()}), folder / "record.log");
  dds::Participant there("phantom_sensing", test_network());
  dds::Writer<msg::HitAlert> alerts(there, dds::kHitAlert);
  dds::Writer<msg::SlaveState> slaves(there, dds::kSlaveState);
  dds::Writer<msg::MasterState> masters(there, dds::kMasterState);
  dds::Writer<msg::Percept> percepts(there, dds::kPercept);
  ASSERT_TRUE(eventually(
      [&] {
        return alerts.matched() > 0 && slaves.matched() > 0 && masters.matched() > 0 &&
               percepts.matched() > 0;
      },
      std::chrono::seconds(60)))
      << recorder.output();
  dds::Stamper stamper(there);
  const double home[] = {-0.1, -1.5708, 1.4, -2.2, 0.0, 0.9, 0.0};
  for (int i = 1; i <= 200; ++i) {
    msg::SlaveState slave;
    msg::MasterState master;
    msg::Percept felt;
    for (msg::Stamp* stamp : {&slave.stamp(), &master.stamp(), &felt.stamp()}) *stamp = stamper.next();
    slave.joint_count(7), master.joint_count(7), felt.joint_count(7);
    for (std::size_t j = 0; j < 7; ++j) {
      slave.position_rad()[j] = home[j] + 0.001 / (i + static_cast<double>(j));
      slave.velocity_rad_s()[j] = 1.0 / (3.0 + i);
      slave.loop_torque_Nm()[j] = 7.0 / i;
      master.position_rad()[j] = home[j] - 0.001 / i;
      master.percept_torque_Nm()[j] = static_cast<double>(j) / i;
      felt.drag_torque_Nm()[j] = -static_cast<double>(j) / i;
    }
    slave.clearance_m(-1.0), slave.contact_force_N(-1.0);
    felt.valid(i % 3 != 0);
    felt.condition(felt.valid() ? msg::PerceptCondition::PERCEPT_FRESH
                                : msg::PerceptCondition::PERCEPT_STATE_STALE);
    felt.closeness(felt.valid() ? 1.0 / i : 0.0), felt.speed_m_s(0.01 * i);
    felt.position_m().x(0.1 * i), felt.position_m().z(-1.0 / i);
    felt.object(static_cast<std::uint16_t>(felt.valid() ? i % 2 : 0));
    slaves.write(slave);
    masters.write(master);
    percepts.write(felt);
    if (i % 10 != 0) continue;
    msg::HitAlert alert;
    alert.stamp(stamper.next());
    alert.alert(static_cast<std::uint32_t>(i));
    alert.rule(msg::HitRule::HIT_FAR_NEARING);
    alert.link_name("gripper");
    alerts.write(alert);
    ASSERT_TRUE(eventually([&] { return last_alert_in(folder / "out") == i; })) << recorder.output();
  }
  // Diagnostics come once a second of the recording.
  std::this_thread::sleep_for(std::chrono::milliseconds(1200));
  slaves.write([&] {
    msg::SlaveState slave;
    slave.stamp(stamper.next());
    slave.joint_count(7), slave.clearance_m(-1.0), slave.contact_force_N(-1.0);
    for (std::size_t j = 0; j < 7; ++j) slave.position_rad()[j] = home[j];
    return slave;
  }());
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  ASSERT_EQ(recorder.end(SIGINT), 0) << recorder.output();

  const auto files = files_in(folder / "out");
  ASSERT_EQ(files.size(), 1u);
  std::string output;
  ASSERT_EQ(run("convert", {files[0].string(), "--out", (folder / "out.jsonl").string()}, &output), 0)
      << output;
  ASSERT_EQ(run("export", {files[0].string(), "--out", (folder / "bag.mcap").string()}, &output), 2);
  EXPECT_THAT(output, HasSubstr("allowed: --ros2"));
  ASSERT_EQ(run("export", {"--ros2", files[0].string(), "--out", (folder / "bag.mcap").string()}, &output), 0)
      << output;
  EXPECT_THAT(output, Not(HasSubstr("left out")));
  EXPECT_TRUE(recording::check(folder / "bag.mcap")->ok());
  setenv("READERS", PHANTOM_READERS, 1);
  Process reader({PHANTOM_NODE, PHANTOM_SOURCE_DIR "/tests/recording/read_bag.mjs",
                  (folder / "bag.mcap").string(), (folder / "out.jsonl").string()},
                 folder / "node.log");
  ASSERT_EQ(reader.wait(), 0) << reader.output();
  const auto report = nlohmann::json::parse(reader.output());
  EXPECT_GT(report["recorded"], 500);
  EXPECT_EQ(report["published"], report["messages"]) << "each has a published definition";
  EXPECT_EQ(report["types"].size(), 12u) << report["types"];
  EXPECT_EQ(report["hashes"]["tf2_msgs/msg/TFMessage"],
            "RIHS01_e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087");
  EXPECT_THAT(report["last"]["diagnostics"].dump(), HasSubstr("phantom: hit alert"));
  EXPECT_THAT(report["last"]["description"].dump(), HasSubstr("<robot"));
}

}  // namespace
}  // namespace phantom::recorder_process

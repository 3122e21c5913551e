// The recorder's executable: killed at any moment, read by other people's tools, stopped, triggered,
// replayed.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <random>
#include <regex>
#include <set>
#include <thread>

#include "common/dds/cdr.hpp"
#include "common/dds/endpoint.hpp"
#include "common/dds/stamp.hpp"
#include "common/dds/tests/test_network.hpp"
#include "common/observation/payload_writer.hpp"
#include "common/recording/mcap_check.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/frozen_thread.hpp"

namespace phantom {
namespace {

using dds::eventually;
using dds::test_network;
using test::Process;
using test::read_text;
using testing::HasSubstr;

class Recorded : public testing::Test {
 protected:
  void SetUp() override {
    std::filesystem::remove_all(folder);
    std::filesystem::create_directories(folder);
    std::string topology = read_text(PHANTOM_SOURCE_DIR "/deploy/topologies/single_host.yaml");
    for (auto at = topology.find("../"); at != std::string::npos; at = topology.find("../", at + 1))
      topology.replace(at, 3, PHANTOM_SOURCE_DIR "/deploy/");
    std::ofstream(folder / "topology.yaml") << topology;
    std::ofstream(folder / "config.yaml")
        << "disk: {margin_MB: 0}\nflush_interval_s: 0.02\nchunk_kB: 4\nqueue_MB: 4\n"
           "window: {before_s: 5, after_s: 1}\n";
  }
  void TearDown() override {
    if (!HasFailure()) std::filesystem::remove_all(folder);
  }

  std::vector<std::string> command(const std::string& what, const std::vector<std::string>& more = {}) const {
    std::vector<std::string> arguments{PHANTOM_BIN_DIR "/dds_recorder",
                                       what,
                                       "--domain",
                                       std::to_string(test_network().domain),
                                       "--deployment",
                                       (folder / "topology.yaml").string(),
                                       "--config",
                                       (folder / "config.yaml").string()};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  }
  int run(const std::string& what, const std::vector<std::string>& more, std::string* output = nullptr) {
    Process process(command(what, more), folder / (what + ".log"));
    const int code = process.wait();
    if (output != nullptr) *output = process.output();
    return code;
  }
  static std::vector<std::filesystem::path> files_in(const std::filesystem::path& where) {
    std::vector<std::filesystem::path> files;
    if (!std::filesystem::exists(where)) return files;
    for (const auto& entry : std::filesystem::directory_iterator(where)) files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    return files;
  }
  /// Topics whose samples have reached the disk, of a recording that may go on.
  static std::set<std::string> topics_in(const std::filesystem::path& where) {
    std::set<std::string> topics;
    for (const auto& file : files_in(where)) {
      const auto reader = recording::McapReader::open(file);
      if (!reader) continue;
      recording::MessageCursor cursor(*reader);
      for (recording::Message message; cursor.next(message);)
        topics.insert(reader->channels().at(message.channel_id).topic);
    }
    return topics;
  }
  /// Numbers of the alerts in a file, each of which must be as it was written.
  static std::vector<std::uint32_t> alerts_in(const recording::McapReader& reader) {
    std::vector<std::uint32_t> numbers;
    recording::MessageCursor cursor(reader);
    for (recording::Message message; cursor.next(message);) {
      if (reader.channels().at(message.channel_id).topic != "hit_alert") continue;
      msg::HitAlert alert;
      EXPECT_TRUE(dds::decode(dds::kHitAlert, message.data, alert));
      EXPECT_EQ(alert.mu(), 3.0 * alert.alert());
      EXPECT_EQ(alert.stamp().sequence_number(), alert.alert());
      numbers.push_back(alert.alert());
    }
    EXPECT_TRUE(cursor.problems().empty());
    return numbers;
  }

  /// Number of the last alert that has reached the disk, of a recording that may go on; 0: none.
  static int last_alert_in(const std::filesystem::path& where) {
    std::uint32_t last = 0;
    for (const auto& file : files_in(where)) {
      const auto reader = recording::McapReader::open(file);
      if (!reader) continue;
      recording::MessageCursor cursor(*reader);
      for (recording::Message message; cursor.next(message);) {
        msg::HitAlert alert;
        if (reader->channels().at(message.channel_id).topic != "hit_alert") continue;
        if (dds::decode(dds::kHitAlert, message.data, alert)) last = std::max(last, alert.alert());
      }
    }
    return static_cast<int>(last);
  }

  std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("phantom_recorder_" + std::to_string(getpid()));
};

/// Writes numbered alerts for as long as it lives. Keeps 4,000 of them, not the 64 of the topic's
/// contract: a recorder that a loaded machine lets wait misses none.
class AlertWriter {
 public:
  explicit AlertWriter(std::chrono::microseconds period)
      : thread_([this, period](const std::stop_token& stop) {
          dds::Stamper stamper(participant_);
          const dds::CdrCodec codec(dds::kHitAlert);
          std::vector<std::uint8_t> bytes;
          while (!stop.stop_requested()) {
            msg::HitAlert alert;
            alert.stamp(stamper.next());
            alert.alert(static_cast<std::uint32_t>(alert.stamp().sequence_number()));
            alert.mu(3.0 * alert.alert());
            alert.cleared(true);
            codec.encode(&alert, bytes);
            writer_.write(bytes);
            ++written_;
            std::this_thread::sleep_for(period);
          }
        }) {}
  std::uint32_t matched() const { return writer_.matched(); }
  std::uint32_t written() const { return written_; }

 private:
  dds::Participant participant_{"phantom_sensing", test_network()};
  observation::PayloadWriter writer_{participant_,
                                     {dds::kHitAlert.name, dds::kHitAlert.type_name},
                                     {.reliability = diagnostics::Reliability::kReliable},
                                     4'000};
  std::atomic<std::uint32_t> written_{0};
  std::jthread thread_;
};

class Killed : public Recorded {};

// Tries dds_recorder: it is killed
TEST_F(Killed, AHundredTimesAtAnyMomentEveryCompletedChunkCanBeRead) {
  constexpr int kRounds = 20, kAtOnce = 5;
  std::mt19937 random(11);
  std::uint64_t samples = 0, torn = 0, with_samples = 0;
  for (int round = 0; round < kRounds; ++round) {
    // A writer that had known the killed ones would send to their ports yet. A new recorder has these
    // ports, hears samples there before the writer has matched it, and misses those until then.
    AlertWriter writer(std::chrono::microseconds(500));
    std::vector<std::unique_ptr<Process>> recorders;
    std::vector<std::filesystem::path> folders;
    for (int i = 0; i < kAtOnce; ++i) {
      folders.push_back(folder / (std::to_string(round) + "_" + std::to_string(i)));
      recorders.push_back(std::make_unique<Process>(
          command("record", {"--folder", folders.back().string(), "--topics", "hit_alert"}),
          folder / "killed.log"));
    }
    const auto size_of = [](const std::filesystem::path& where) {
      const auto files = files_in(where);
      return files.empty() ? 0 : std::filesystem::file_size(files[0]);
    };
    for (std::size_t i = 0; i < recorders.size(); ++i) {
      // Any moment from the first bytes on; in most rounds when samples flow.
      const std::uintmax_t least = random() % 5 == 0 ? 1 : 20'000 + random() % 40'000;
      ASSERT_TRUE(eventually([&] { return size_of(folders[i]) >= least; }, std::chrono::seconds(60)));
      std::this_thread::sleep_for(std::chrono::microseconds(random() % 5000));
      ASSERT_EQ(recorders[i]->end(SIGKILL), 128 + SIGKILL);
      const auto files = files_in(folders[i]);
      ASSERT_EQ(files.size(), 1u);
      const auto reader = recording::McapReader::open(files[0]);
      if (!reader && std::filesystem::file_size(files[0]) < 100) continue;  // not even the header
      ASSERT_TRUE(reader) << reader.status().message();
      EXPECT_FALSE(reader->complete());
      ASSERT_LE(reader->problems().size(), 1u) << "nothing but a torn end";
      torn += reader->problems().size();
      const auto numbers = alerts_in(*reader);
      for (std::size_t k = 1; k < numbers.size(); ++k)
        ASSERT_EQ(numbers[k], numbers[k - 1] + 1) << "none is missing between";
      samples += numbers.size();
      with_samples += numbers.empty() ? 0 : 1;
    }
  }
  EXPECT_GT(with_samples, 50u);
  RecordProperty("samples_read", std::to_string(samples));
  RecordProperty("torn_ends", std::to_string(torn));
}

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
  EXPECT_EQ(report["types"].size(), 10u) << report["types"];
  EXPECT_EQ(report["hashes"]["tf2_msgs/msg/TFMessage"],
            "RIHS01_e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087");
  EXPECT_THAT(report["last"]["diagnostics"].dump(), HasSubstr("phantom: hit alert"));
  EXPECT_THAT(report["last"]["description"].dump(), HasSubstr("<robot"));
}

class Signalled : public Recorded {};

TEST_F(Signalled, OnEventNothingIsWrittenUntilACommandOrASignalComes) {
  AlertWriter writer(std::chrono::microseconds(5000));
  Process recorder(
      command("record", {"--folder", (folder / "out").string(), "--on-event", "--topics", "hit_alert"}),
      folder / "record.log");
  ASSERT_TRUE(eventually([&] { return writer.matched() > 0; }, std::chrono::seconds(60)));
  const std::uint32_t heard = writer.written();
  ASSERT_TRUE(eventually([&] { return writer.written() > heard + 100; }));
  EXPECT_TRUE(files_in(folder / "out").empty());
  std::string output;
  ASSERT_EQ(run("trigger", {"--by", "the test"}, &output), 0) << output;
  ASSERT_TRUE(eventually([&] { return files_in(folder / "out").size() == 1; }, std::chrono::seconds(60)))
      << recorder.output();
  ASSERT_TRUE(eventually([&] { return recorder.output().find("event over") != std::string::npos; },
                         std::chrono::seconds(60)));
  recorder.signal(SIGUSR1);
  ASSERT_TRUE(eventually([&] { return files_in(folder / "out").size() == 2; }, std::chrono::seconds(60)));
  EXPECT_EQ(recorder.end(SIGTERM), 0);
  const auto files = files_in(folder / "out");
  for (const auto& file : files) EXPECT_TRUE(recording::check(file)->ok()) << file;
  const auto first = recording::McapReader::open(files[0]), second = recording::McapReader::open(files[1]);
  EXPECT_THAT(first->metadata("phantom.trigger").at(0).at("reason"), HasSubstr("the test"));
  EXPECT_EQ(second->metadata("phantom.trigger").at(0).at("reason"), "SIGUSR1");
  const auto alerts = alerts_in(*first);
  ASSERT_GT(alerts.size(), 100u);
  EXPECT_LT(alerts.front(), heard + 100) << "from before the command";
}

class SlowDisk : public Recorded {
 protected:
  /// Time of day in s and number of samples of each line that says what found no room.
  static std::vector<std::pair<double, std::uint64_t>> told(const std::string& log) {
    std::vector<std::pair<double, std::uint64_t>> lines;
    static const std::regex line(
        R"((\d\d):(\d\d):(\d\d\.\d+) .*dds_recorder: (\d+) samples found no room in the queue so far; )"
        R"(allowed: a larger queue_MB, fewer topics, a faster disk\n)");
    for (std::sregex_iterator i(log.begin(), log.end(), line); i != std::sregex_iterator(); ++i)
      lines.emplace_back(3600 * std::stod((*i)[1]) + 60 * std::stod((*i)[2]) + std::stod((*i)[3]),
                         std::stoull((*i)[4]));
    return lines;
  }
};

// The thread that writes hangs again and again, as in a write to a slow disk, while DDS goes on.
// Tries dds_recorder: the disk is slow; too many samples
TEST_F(SlowDisk, WhatFindsNoRoomIsCountedPerTopicAndLoggedAtMostEveryHalfSecond) {
  std::ofstream(folder / "config.yaml") << "disk: {margin_MB: 0}\nqueue_MB: 1\n";
  AlertWriter writer(std::chrono::microseconds(0));
  Process recorder(command("record", {"--folder", (folder / "out").string(), "--topics", "hit_alert"}),
                   folder / "record.log");
  ASSERT_TRUE(eventually([&] { return last_alert_in(folder / "out") > 0; }, std::chrono::seconds(60)));
  const auto hang = [&](std::uint32_t alerts) {
    const test::FrozenThread writing(recorder.pid());
    const std::uint32_t before = writer.written();
    return eventually([&] { return writer.written() > before + alerts; }, std::chrono::seconds(120));
  };
  // How many of the alerts arrive is DDS's affair: it hangs until some have found no room.
  for (std::size_t i = 0; i < 3; ++i) {
    const auto is_told = [&] { return told(recorder.output()).size() > i; };
    ASSERT_TRUE(eventually([&] { return hang(20'000) && eventually(is_told, std::chrono::seconds(2)); },
                           std::chrono::seconds(180)))
        << recorder.output();
  }
  for (int i = 0; i < 20; ++i) {  // more often than a line may come, on a host that is not too busy
    ASSERT_TRUE(hang(6'000));
    std::this_thread::sleep_for(std::chrono::milliseconds(30));
  }
  EXPECT_EQ(recorder.end(SIGINT), 0);
  const auto lines = told(recorder.output());
  for (std::size_t i = 1; i < lines.size(); ++i)
    EXPECT_GT(lines[i].second, lines[i - 1].second) << "only what is new is told";
  // The thread may hang just before it writes a line: single lines come late, but not more of them.
  const double duration_s = lines.back().first - lines.front().first;
  EXPECT_LE(static_cast<double>(lines.size()), duration_s / 0.5 + 2.0);
  std::uint64_t overflow = 0;
  for (const auto& file : files_in(folder / "out")) {
    const auto losses = recording::McapReader::open(file)->metadata("phantom.losses");
    ASSERT_FALSE(losses.empty());
    overflow += std::stoull(losses.back().at("hit_alert.queue_overflow"));
    for (const auto& [what, unused] : losses.back())
      EXPECT_TRUE(what.find(".queue_overflow") == std::string::npos || what == "hit_alert.queue_overflow")
          << what;
  }
  EXPECT_GE(overflow, lines.back().second);
}

class ReplayedProcess : public Recorded {
 protected:
  /// Records more than 300 of the writer's alerts; the file.
  std::filesystem::path record(const AlertWriter& writer) {
    Process recorder(command("record", {"--folder", (folder / "out").string(), "--topics", "hit_alert"}),
                     folder / "record.log");
    EXPECT_TRUE(eventually([&] { return writer.matched() > 0; }, std::chrono::seconds(60)));
    const std::uint32_t heard = writer.written();
    EXPECT_TRUE(eventually([&] { return writer.written() > heard + 300; }));
    EXPECT_EQ(recorder.end(SIGINT), 0);
    const auto files = files_in(folder / "out");
    return files.size() == 1 ? files[0] : std::filesystem::path();
  }
};

TEST_F(ReplayedProcess, WhatWasRecordedComesAgainToTypedReadersAsIfNew) {
  std::filesystem::path file;
  {
    const AlertWriter writer(std::chrono::microseconds(2000));
    file = record(writer);
    ASSERT_FALSE(file.empty());
    std::string output;
    EXPECT_EQ(run("replay", {file.string()}, &output), 3) << "while the writer is there";
    EXPECT_THAT(output, HasSubstr("hit_alert is written by"));
  }
  const auto recorded = alerts_in(*recording::McapReader::open(file));
  dds::Participant here("viewer", test_network());
  dds::Waiter waiter;
  std::vector<msg::HitAlert> got;
  dds::SequenceGuard guard;
  bool in_order = true;
  dds::Reader<msg::HitAlert> reader(here, dds::kHitAlert,
                                    [&](const msg::HitAlert& alert, const dds::SampleInfo&) {
                                      waiter.change([&] {
                                        in_order = in_order && guard.accept(alert.stamp());
                                        got.push_back(alert);
                                      });
                                    });
  // As fast as it goes, and more than the 64 alerts that a writer keeps: this reader is waited for.
  ASSERT_GT(recorded.size(), 100U);
  std::string output;
  ASSERT_EQ(run("replay", {file.string(), "--loops", "2", "--rate", "0", "--wait", "30"}, &output), 0)
      << output;
  ASSERT_TRUE(waiter.wait([&] { return got.size() >= 2 * recorded.size(); }));
  EXPECT_TRUE(in_order) << "receivers that refuse what is not newer accept all, in both turns";
  for (std::size_t i = 0; i < recorded.size(); ++i) {
    ASSERT_EQ(got[i].alert(), recorded[i]);
    ASSERT_EQ(got[recorded.size() + i].alert(), recorded[i]);
  }
  EXPECT_LT(std::abs(core::monotonic_ns() - got.back().stamp().monotonic_ns()), 60 * core::kNsPerSecond)
      << "stamped now";
}

TEST_F(ReplayedProcess, AReaderThatIsFrozenDoesNotHoldItUp) {
  const std::filesystem::path file = record(AlertWriter(std::chrono::microseconds(500)));
  ASSERT_FALSE(file.empty());
  Process frozen(command("record", {"--folder", (folder / "other").string(), "--topics", "hit_alert"}),
                 folder / "frozen.log");
  Process replay(command("replay", {file.string(), "--loop", "--wait", "60"}), folder / "replay.log");
  const auto samples_flow = [&] {
    const auto files = files_in(folder / "other");
    return !files.empty() && std::filesystem::file_size(files[0]) > 20'000;
  };
  ASSERT_TRUE(eventually(samples_flow, std::chrono::seconds(60))) << replay.output();
  frozen.signal(SIGSTOP);
  EXPECT_TRUE(eventually([&] { return replay.output().find("hit_alert does not take") != std::string::npos; },
                         std::chrono::seconds(60)))
      << replay.output();
  EXPECT_EQ(replay.end(SIGINT), 0) << replay.output();
  frozen.signal(SIGCONT);
}

class Frozen : public Recorded {};

// What a writer keeps is freed while heartbeats, as often as the profile says, tell of it to a reader that
// acknowledges nothing.
TEST_F(Frozen, AWriterOfThousandsOfSamplesEndsThoughItsReaderHasNone) {
  Process reader(command("record", {"--folder", (folder / "out").string(), "--topics", "workspace_brick"}),
                 folder / "record.log");
  dds::Participant there("wva_server", test_network());
  for (int round = 0; round < 5; ++round) {
    std::optional<dds::Writer<msg::WorkspaceBrick>> writer(std::in_place, there, dds::kWorkspaceBrick);
    ASSERT_TRUE(eventually([&] { return writer->matched() == 1; }, std::chrono::seconds(60)));
    reader.signal(SIGSTOP);
    msg::WorkspaceBrick brick;
    for (int i = 0; i < 20'000; ++i) {
      brick.bx(i);
      ASSERT_TRUE(writer->write(brick));
    }
    writer.reset();
    reader.signal(SIGCONT);
  }
}

class LittleSpace : public Recorded {
 protected:
  /// Arguments of a recording whose margin leaves it `MB` of what is free now.
  std::vector<std::string> leaving(std::int64_t MB) {
    const auto free_MB = static_cast<std::int64_t>(std::filesystem::space(folder).available / 1'000'000);
    std::ofstream(folder / "config.yaml")
        << "disk: {margin_MB: " << free_MB - MB << "}\nflush_interval_s: 0.02\nchunk_kB: 4\n";
    return {"--folder", (folder / "kept").string()};
  }
};

// Tries dds_recorder: less than the margin is free at start
TEST_F(LittleSpace, AtTheStartIsMissing) {
  std::string said;
  EXPECT_EQ(run("record", leaving(-1'000), &said), 3);
  EXPECT_THAT(said, HasSubstr("disk.margin_MB"));
  EXPECT_TRUE(files_in(folder / "kept").empty());
}

// Tries dds_recorder: the margin is reached
TEST_F(LittleSpace, WhileItRecordsFinishesTheFileAndEndsWithOne) {
  constexpr std::int64_t kLeft_MB = 400;
  AlertWriter writer(std::chrono::milliseconds(2));
  Process recorder(command("record", leaving(kLeft_MB)), folder / "record.log");
  ASSERT_TRUE(
      eventually([&] { return topics_in(folder / "kept").contains("hit_alert"); }, std::chrono::seconds(60)))
      << recorder.output();
  const int others = open((folder / "others").c_str(), O_CREAT | O_WRONLY, 0600);
  ASSERT_EQ(posix_fallocate(others, 0, 2 * kLeft_MB * 1'000'000), 0);
  close(others);
  EXPECT_EQ(recorder.wait(), 1);
  std::filesystem::remove(folder / "others");
  EXPECT_THAT(recorder.output(), HasSubstr("disk.margin_MB"));
  EXPECT_TRUE(recording::check(files_in(folder / "kept").at(0))->ok()) << "finished";
}

// Tries dds_recorder: the folder cannot be written
TEST(CommandLine, WrongRequestsAreNamed) {
  const auto log = std::filesystem::temp_directory_path() / ("dds_recorder_cli_" + std::to_string(getpid()));
  const auto run = [&](const std::vector<std::string>& more) {
    std::vector<std::string> arguments{PHANTOM_BIN_DIR "/dds_recorder"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    Process process(arguments, log);
    const int code = process.wait();
    return std::pair(code, process.output());
  };
  EXPECT_EQ(run({}).first, 2);
  EXPECT_EQ(run({"info", "/nowhere.mcap"}).first, 3);
  EXPECT_EQ(run({"replay", "/nowhere.mcap"}).first, 3);
  EXPECT_EQ(run({"replay", "/nowhere.mcap", "--remap", "x"}).first, 2);
  EXPECT_EQ(run({"replay", "/nowhere.mcap", "--rate", "-1"}).first, 2);
  const auto [code, output] = run({"record", "--folder", "/proc/nowhere"});
  EXPECT_EQ(code, 3);
  EXPECT_THAT(output, HasSubstr("/proc/nowhere"));
  std::filesystem::remove(log);
}

}  // namespace
}  // namespace phantom

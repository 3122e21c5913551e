// The recorder's executable: killed at any moment, stopped, triggered, replayed.
#include "tests/recording/recorded.hpp"

namespace phantom::recorder_process {
namespace {

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
  // A pause for the reader: of a writer without one, DDS loses so much on a busy host that the queue never
  // fills.
  AlertWriter writer(std::chrono::microseconds(20));
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

TEST_F(ReplayedProcess, ARecordingOfAnEarlierStateOfTheProjectPlays) {
  dds::Participant here("viewer", test_network());
  std::atomic<int> drag_fields{0}, statuses{0};
  dds::Reader<msg::DragField> fields(here, dds::kDragField,
                                     [&](const msg::DragField& field, const dds::SampleInfo&) {
                                       if (field.joint_count() > 0) ++drag_fields;
                                     });
  dds::Reader<msg::ComponentStatus> components(
      here, dds::kComponentStatus, [&](const msg::ComponentStatus& status, const dds::SampleInfo&) {
        if (status.component_name().size() > 0) ++statuses;
      });
  std::string output;
  const std::string kept = PHANTOM_SOURCE_DIR "/tests/recording/kept/session.mcap";
  ASSERT_EQ(run("replay", {kept, "--wait", "30"}, &output), 0) << output;
  EXPECT_TRUE(eventually([&] { return drag_fields > 0 && statuses > 0; }))
      << drag_fields << " drag fields, " << statuses << " statuses";
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

class OtherCompression : public Recorded {
 protected:
  static constexpr std::string_view kZstd{"\4\0\0\0zstd", 8}, kUnknown{"\4\0\0\0lz4x", 8};

  /// Records the kept recording again, in the small chunks that the configuration says.
  std::string in_small_chunks() {
    Process recorder(command("record", {"--folder", (folder / "parts").string()}), folder / "record.log");
    std::string said;
    EXPECT_EQ(run("replay",
                  {PHANTOM_SOURCE_DIR "/tests/recording/kept/session.mcap", "--wait", "60", "--beside-live"},
                  &said),
              0)
        << said;
    EXPECT_TRUE(eventually([&] { return topics_in(folder / "parts").size() >= 5; })) << recorder.output();
    EXPECT_EQ(recorder.end(SIGINT), 0) << recorder.output();
    return read_text(files_in(folder / "parts").at(0));
  }
  /// Returns a file of these bytes, of which the first `chunks` chunks look as if they were compressed
  /// otherwise.
  std::filesystem::path recompressed(std::string bytes, int chunks) {
    int changed = 0;
    for (std::size_t at = bytes.find(kZstd); at != std::string::npos && changed < chunks;
         at = bytes.find(kZstd, at + 1)) {
      bytes.replace(at, kZstd.size(), kUnknown);
      ++changed;
    }
    EXPECT_TRUE(changed == chunks || changed > 5) << changed;
    const auto file = folder / ("lz4_" + std::to_string(chunks) + ".mcap");
    std::ofstream(file, std::ios::binary) << bytes;
    return file;
  }
};

// Tries dds_recorder: has a compression that is not read
TEST_F(OtherCompression, ConvertExportAndReplayEndWithAFailureAndSayWhy) {
  const std::string parts = in_small_chunks();
  const std::string some = recompressed(parts, 1).string(), none = recompressed(parts, 1'000'000).string();
  std::string said;
  const auto out = [&](const char* name) { return (folder / name).string(); };
  EXPECT_EQ(run("convert", {some, "--out", out("rest.mcap")}, &said), 1) << said;
  EXPECT_THAT(said, HasSubstr("1 chunks could not be read"));
  EXPECT_TRUE(std::filesystem::exists(out("rest.mcap")));
  const std::vector<std::string> exported{"--ros2", some, "--out", out("rest.bag.mcap")};
  EXPECT_EQ(run("export", exported, &said), 1) << said;
  EXPECT_THAT(said, HasSubstr("1 chunks could not be read"));
  EXPECT_EQ(run("replay", {some, "--rate", "0"}, &said), 1) << said;
  EXPECT_THAT(said, HasSubstr("'lz4x'"));
  EXPECT_THAT(said, HasSubstr("its samples were not replayed"));
  EXPECT_EQ(run("convert", {none, "--out", out("nothing.mcap"), "--topics", "drag_field"}, &said), 1) << said;
  EXPECT_FALSE(std::filesystem::exists(out("nothing.mcap")));
  EXPECT_EQ(run("export", {"--ros2", none, "--out", out("nothing.bag.mcap")}, &said), 1) << said;
  Process percepts({PHANTOM_BIN_DIR "/phantom_sensing", "replay", "--recording", some, "--cell",
                    PHANTOM_SOURCE_DIR "/deploy/cells/hot_cell/cell.yaml"},
                   folder / "percepts.log");
  EXPECT_EQ(percepts.wait(), 1) << percepts.output();
  EXPECT_THAT(percepts.output(), HasSubstr("chunks of it cannot be read"));
}

class GoneFile : public Recorded {};

// Tries dds_recorder: its file is removed or cut by others
TEST_F(GoneFile, EndsARecordingWithAFailureThatNamesIt) {
  const std::pair<const char*, std::function<void(const std::filesystem::path&)>> kWays[] = {
      {"was removed while it was written",
       [](const std::filesystem::path& file) { std::filesystem::remove(file); }},
      {"was changed by others while it was written",
       [](const std::filesystem::path& file) { std::filesystem::resize_file(file, 10); }}};
  AlertWriter writer(std::chrono::milliseconds(1));
  for (const auto& [says, spoil] : kWays) {
    const auto kept = folder / "kept";
    std::filesystem::remove_all(kept);
    Process recorder(command("record", {"--folder", kept.string(), "--topics", "hit_alert"}),
                     folder / "record.log");
    ASSERT_TRUE(eventually([&] { return topics_in(kept).contains("hit_alert"); }, std::chrono::seconds(60)))
        << recorder.output();
    const auto file = files_in(kept).at(0);
    spoil(file);
    EXPECT_EQ(recorder.wait(), 1) << says;
    EXPECT_THAT(recorder.output(), HasSubstr(file.string() + ": " + says));
  }
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

class SizeLimit : public Recorded {};

// Tries dds_recorder: a write fails, also beyond `ulimit -f`
TEST_F(SizeLimit, EndsTheFileWithItsLastWholeChunkAndIsTold) {
  std::ofstream(folder / "config.yaml") << "disk: {margin_MB: 0}\nflush_interval_s: 0.02\nchunk_kB: 4\n";
  AlertWriter writer(std::chrono::milliseconds(1));
  Process recorder(command("record", {"--folder", (folder / "kept").string(), "--topics", "hit_alert"}),
                   folder / "record.log");
  ASSERT_TRUE(
      eventually([&] { return topics_in(folder / "kept").contains("hit_alert"); }, std::chrono::seconds(60)))
      << recorder.output();
  const auto file = files_in(folder / "kept").at(0);
  const rlimit limit{std::filesystem::file_size(file) + 50'000, RLIM_INFINITY};
  ASSERT_EQ(prlimit(recorder.pid(), RLIMIT_FSIZE, &limit, nullptr), 0);
  EXPECT_EQ(recorder.wait(), 1);
  EXPECT_THAT(recorder.output(), HasSubstr("File too large"));
  const auto reader = recording::McapReader::open(file);
  ASSERT_TRUE(reader) << reader.status().message();
  EXPECT_GT(alerts_in(*reader).size(), 0u);
  EXPECT_LE(std::filesystem::file_size(file), limit.rlim_cur);
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
}  // namespace phantom::recorder_process

// What goes into which file: continuous and on events, splits, the state at a file's start, losses, the
// disk's margin.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <numeric>

#include "components/dds_recorder/tests/fake_world.hpp"

namespace phantom::dds_recorder {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

RecorderSettings continuous() {
  RecorderSettings settings;
  settings.margin_bytes = 1'000'000;
  return settings;
}

RecorderSettings on_event() {
  RecorderSettings settings = continuous();
  settings.on_event = true;
  settings.before_ns = 5 * FakeWorld::kSecond;
  settings.after_ns = 2 * FakeWorld::kSecond;
  return settings;
}

bool passes_check(const MemorySink& file) {
  const auto report = recording::check(std::make_unique<recording::MemorySource>(file.bytes()));
  for (const auto& problem : report->problems) ADD_FAILURE() << problem;
  return report->ok();
}

TEST(Continuous, KeepsEverySampleWithItsTimesChannelAndSchema) {
  FakeWorld world;
  const auto owner = world.recorder(continuous());
  Recorder& recorder = *owner;
  recorder.tick(0);
  for (std::uint64_t i = 1; i <= 100; ++i)
    recorder.take(world.sample(world.state, i, static_cast<core::Nanoseconds>(i) * core::kNsPerMillisecond));
  recorder.finish(FakeWorld::kSecond);
  ASSERT_EQ(world.files.size(), 1u);
  const auto& [path, file] = *world.files.begin();
  EXPECT_EQ(path, "/disk/phantom_20231114T221320Z_000.mcap");
  EXPECT_TRUE(passes_check(*file));
  const auto reader = world.open(path);
  const auto messages = all_messages(reader);
  ASSERT_EQ(messages.size(), 100u);
  EXPECT_EQ(messages[4].log_time_ns,
            static_cast<std::uint64_t>(FakeWorld::kUtc + 5 * core::kNsPerMillisecond));
  EXPECT_EQ(messages[4].publish_time_ns, messages[4].log_time_ns - 1000);
  EXPECT_EQ(messages[4].data, (recording::Bytes{1, 2, 3}));
  const auto& channel = reader.channels().begin()->second;
  EXPECT_EQ(channel.topic, "state");
  EXPECT_EQ(channel.message_encoding, "cdr");
  EXPECT_EQ(channel.metadata.at("component"), "writer_1");
  EXPECT_EQ(channel.metadata.at("partition"), "cell");
  EXPECT_EQ(reader.schemas().at(channel.schema_id).name, "T");
  EXPECT_EQ(reader.schemas().at(channel.schema_id).encoding, "omgidl");
  EXPECT_EQ(reader.metadata(kEndRecord).at(0).at("reason"), "stopped");
}

TEST(Continuous, EveryFileOfASplitStandsAlone) {
  FakeWorld world;
  RecorderSettings settings = continuous();
  settings.split_ns = 10 * FakeWorld::kSecond;
  const auto owner = world.recorder(settings);
  Recorder& recorder = *owner;
  recorder.tick(0);
  for (std::uint8_t instance = 0; instance < 3; ++instance)
    recorder.take(world.sample(world.brick, 1U + instance, core::kNsPerMillisecond, {instance, 1}));
  for (std::uint64_t i = 1; i <= 25; ++i) {
    const auto now_ns = static_cast<core::Nanoseconds>(i) * FakeWorld::kSecond;
    recorder.take(world.sample(world.state, i, now_ns));
    if (i == 12) recorder.take(world.sample(world.brick, 4, now_ns, {1, 2}));  // instance 1 changes
    recorder.tick(now_ns);
  }
  recorder.finish(26 * FakeWorld::kSecond);
  ASSERT_EQ(world.files.size(), 3u);
  for (const auto& [path, file] : world.files) EXPECT_TRUE(passes_check(*file)) << path;
  const auto names = world.names();
  const auto first = world.open(names[0]), second = world.open(names[1]), third = world.open(names[2]);
  EXPECT_THAT(numbers(first, "brick"), ElementsAre(1, 2, 3));
  EXPECT_THAT(numbers(first, "brick", true), IsEmpty());
  EXPECT_THAT(numbers(second, "brick", true), ElementsAre(1, 2, 3));
  EXPECT_THAT(numbers(second, "brick"), ElementsAre(4));
  EXPECT_THAT(numbers(third, "brick", true), ElementsAre(1, 3, 4)) << "the newest of each instance";
  std::vector<std::uint32_t> all;
  for (const auto* file : {&first, &second, &third}) {
    for (const auto number : numbers(*file, "state")) all.push_back(number);
  }
  std::vector<std::uint32_t> expected(25);
  std::iota(expected.begin(), expected.end(), 1U);
  EXPECT_EQ(all, expected) << "each once, none lost between files";
  EXPECT_EQ(second.metadata(kAboutRecord).at(0).at("number"), "1");
  EXPECT_EQ(first.metadata(kEndRecord).at(0).at("reason"), "split");
}

TEST(Continuous, SplitsBySizeAndRemembersTheSampleThatMadeItSplit) {
  FakeWorld world;
  RecorderSettings settings = continuous();
  settings.split_bytes = 20'000;
  settings.zstd_level = 0;
  const auto owner = world.recorder(settings);
  Recorder& recorder = *owner;
  recorder.tick(0);
  for (std::uint64_t i = 1; i <= 60; ++i) {
    std::vector<std::uint8_t> bytes(1000, static_cast<std::uint8_t>(i));
    bytes[0] = 7;  // one instance
    recorder.take(
        world.sample(world.brick, i, static_cast<core::Nanoseconds>(i) * core::kNsPerMillisecond, bytes));
  }
  recorder.finish(FakeWorld::kSecond);
  ASSERT_GE(world.files.size(), 3u);
  std::uint32_t last = 0;
  for (const auto& [path, file] : world.files) {
    EXPECT_TRUE(passes_check(*file));
    EXPECT_LT(file->bytes().size(), 26'000u);
    const auto reader = world.open(path);
    if (last > 0) {
      EXPECT_THAT(numbers(reader, "brick", true), ElementsAre(last));
    }
    if (!numbers(reader, "brick").empty()) last = numbers(reader, "brick").back();
  }
  EXPECT_EQ(last, 60u);
}

TEST(OnEvent, WritesTheSecondsBeforeAndAfterAndNothingElse) {
  FakeWorld world;
  const auto owner = world.recorder(on_event());
  Recorder& recorder = *owner;
  recorder.take(world.sample(world.brick, 1, 0, {1, 1}));
  recorder.take(world.sample(world.brick, 2, core::kNsPerMillisecond, {2, 1}));
  for (std::uint64_t i = 1; i <= 300; ++i) {  // 30 s, 10 Hz
    const auto now_ns = static_cast<core::Nanoseconds>(i) * 100 * core::kNsPerMillisecond;
    recorder.take(world.sample(world.state, i, now_ns));
    if (i == 180) recorder.take(world.sample(world.brick, 3, now_ns, {2, 2}));  // within the window
    if (i == 200) recorder.trigger("hit alert 1", now_ns);
    recorder.tick(now_ns);
    EXPECT_EQ(world.files.size(), i < 200 ? 0u : 1u);
  }
  recorder.finish(40 * FakeWorld::kSecond);
  ASSERT_EQ(world.files.size(), 1u);
  const auto& [path, file] = *world.files.begin();
  EXPECT_THAT(path, HasSubstr("_event_"));
  EXPECT_TRUE(passes_check(*file));
  const auto reader = world.open(path);
  const auto states = numbers(reader, "state");
  EXPECT_EQ(states.front(), 150u) << "5 s before";
  EXPECT_EQ(states.back(), 220u) << "2 s after";
  EXPECT_EQ(states.size(), 71u);
  EXPECT_THAT(numbers(reader, "brick", true), ElementsAre(1, 2)) << "the state when the window began";
  EXPECT_THAT(numbers(reader, "brick"), ElementsAre(3));
  EXPECT_EQ(reader.metadata(kTriggerRecord).at(0).at("reason"), "hit alert 1");
  EXPECT_EQ(reader.metadata(kEndRecord).at(0).at("reason"), "event over");
  for (const auto& message : all_messages(reader))
    EXPECT_GE(message.log_time_ns, static_cast<std::uint64_t>(FakeWorld::kUtc + 15 * FakeWorld::kSecond));
}

TEST(OnEvent, AnotherEventProlongsAndALaterOneMakesANewFile) {
  FakeWorld world;
  const auto owner = world.recorder(on_event());
  Recorder& recorder = *owner;
  for (std::uint64_t i = 1; i <= 400; ++i) {
    const auto now_ns = static_cast<core::Nanoseconds>(i) * 100 * core::kNsPerMillisecond;
    recorder.take(world.sample(world.state, i, now_ns));
    if (i == 100 || i == 115 || i == 300) recorder.trigger("event " + std::to_string(i), now_ns);
    recorder.tick(now_ns);
  }
  recorder.finish(41 * FakeWorld::kSecond);
  ASSERT_EQ(world.files.size(), 2u);
  const auto first = world.open(world.names()[0]), second = world.open(world.names()[1]);
  EXPECT_EQ(numbers(first, "state").front(), 50u);
  EXPECT_EQ(numbers(first, "state").back(), 135u);
  EXPECT_EQ(first.metadata(kTriggerRecord).size(), 2u);
  EXPECT_EQ(numbers(second, "state").front(), 250u);
}

TEST(OnEvent, TheWindowIsBoundedInMemory) {
  FakeWorld world;
  RecorderSettings settings = on_event();
  settings.window_bytes = 100'000;
  const auto owner = world.recorder(settings);
  Recorder& recorder = *owner;
  for (std::uint64_t i = 1; i <= 1000; ++i) {
    recorder.take(world.sample(world.state, i, static_cast<core::Nanoseconds>(i) * core::kNsPerMillisecond,
                               std::vector<std::uint8_t>(1000)));
    EXPECT_LE(recorder.figures().window_bytes, 100'000u);
  }
  recorder.trigger("now", FakeWorld::kSecond);
  recorder.finish(FakeWorld::kSecond);
  const auto states = numbers(world.open(world.names()[0]), "state");
  EXPECT_GT(states.size(), 70u);
  EXPECT_LT(states.size(), 100u);
  EXPECT_EQ(states.back(), 1000u) << "the newest are kept";
}

// Tries dds_recorder: too many samples
TEST(Losses, GapsOverflowAndDdsCountsStandInTheFile) {
  FakeWorld world;
  const auto owner = world.recorder(continuous());
  Recorder& recorder = *owner;
  recorder.tick(0);
  for (const std::uint64_t number : {10, 11, 14, 15, 20})
    recorder.take(world.sample(world.state, number, core::kNsPerMillisecond));
  recorder.take(
      world.sample(world.state, 3, core::kNsPerMillisecond, {1}, 2));  // another writer counts by itself
  recorder.take(world.sample(world.brick, 1, core::kNsPerMillisecond, {1}));
  recorder.take(world.sample(world.brick, 9, core::kNsPerMillisecond, {1}));
  recorder.count(world.state, {.overflow = 4, .dds_lost = 5, .dds_rejected = 6});
  recorder.tick(2 * FakeWorld::kSecond);
  const auto expect = [](const recording::StringMap& losses) {
    EXPECT_EQ(losses.at("state.missing"), "6");
    EXPECT_EQ(losses.at("state.queue_overflow"), "4");
    EXPECT_EQ(losses.at("state.dds_lost"), "5");
    EXPECT_EQ(losses.at("state.dds_rejected"), "6");
    EXPECT_EQ(losses.at("brick.superseded"), "7");
    EXPECT_FALSE(losses.contains("brick.missing")) << "an older state of a durable instance is no loss";
  };
  expect(
      world.open(world.names()[0]).metadata(kLossesRecord).at(0));  // also without an end: written as it goes
  recorder.finish(3 * FakeWorld::kSecond);
  expect(world.open(world.names()[0]).metadata(kLossesRecord).back());
  EXPECT_EQ(recorder.figures().losses.missing, 6u);
}

TEST(Losses, EachFileHasItsOwn) {
  FakeWorld world;
  RecorderSettings settings = continuous();
  settings.split_ns = FakeWorld::kSecond;
  const auto owner = world.recorder(settings);
  Recorder& recorder = *owner;
  recorder.tick(0);
  recorder.take(world.sample(world.state, 1, core::kNsPerMillisecond));
  recorder.take(world.sample(world.state, 5, 2 * core::kNsPerMillisecond));
  recorder.tick(FakeWorld::kSecond);
  recorder.take(world.sample(world.state, 8, FakeWorld::kSecond + core::kNsPerMillisecond));
  recorder.finish(FakeWorld::kSecond + 2 * core::kNsPerMillisecond);
  ASSERT_EQ(world.files.size(), 2u);
  EXPECT_EQ(world.open(world.names()[0]).metadata(kLossesRecord).back().at("state.missing"), "3");
  EXPECT_EQ(world.open(world.names()[1]).metadata(kLossesRecord).back().at("state.missing"), "2");
}

SampleView of_writer(FakeWorld& world, TopicNumber topic, std::uint64_t writer, core::Nanoseconds at_ns) {
  SampleView sample = world.sample(topic, 1, at_ns, {static_cast<std::uint8_t>(writer), 2});
  std::memcpy(sample.head.writer.data(), &writer, sizeof writer);
  return sample;
}

TEST(Bounds, AFileHasSoManyChannelsAndTheNextGoesOn) {
  FakeWorld world;
  const auto owner = world.recorder(continuous());
  owner->tick(0);
  for (std::uint64_t writer = 0; writer < RecordingFile::kMaxChannels + 10; ++writer)
    owner->take(of_writer(world, world.state, writer, 1000));
  owner->finish(2000);
  ASSERT_EQ(world.files.size(), 2u);
  const auto names = world.names();
  EXPECT_EQ(world.open(names[0]).channels().size(), RecordingFile::kMaxChannels);
  EXPECT_EQ(all_messages(world.open(names[1])).size(), 10u);
  EXPECT_EQ(owner->figures().losses.unwritten, 0u);
}

TEST(Bounds, DurableSamplesOfTooManyWritersDoNotEndARecording) {
  FakeWorld world;
  auto ports = world.ports();
  ports.instance_of = [](auto, auto, auto&) { return false; };  // each sample counts
  RecorderSettings settings = continuous();
  settings.folder = "/disk";
  settings.split_ns = FakeWorld::kSecond;
  Recorder recorder(settings, RecordingContext{}, ports, ClockPair{0, FakeWorld::kUtc});
  const TopicNumber topic = recorder.add_topic({"brick", "B", true, true, "omgidl", "struct B {};", {}});
  recorder.tick(0);
  constexpr std::uint64_t kWriters = RecordingFile::kMaxChannels / 2 + 100;
  for (std::uint64_t writer = 0; writer < kWriters; ++writer)
    recorder.take(of_writer(world, topic, writer, 1000));
  recorder.tick(2 * FakeWorld::kSecond);
  recorder.take(of_writer(world, topic, kWriters, 2 * FakeWorld::kSecond));
  recorder.finish(3 * FakeWorld::kSecond);
  EXPECT_EQ(recorder.ended(), "");
  ASSERT_EQ(world.files.size(), 2u);
  const auto reader = world.open(world.names()[1]);
  EXPECT_EQ(reader.metadata(kLeftOutRecord).at(0).at("carried_over"), "100");
  EXPECT_EQ(numbers(reader, "brick").size(), 1u);
}

TEST(Bounds, EventsAreCountedAndSoManyNotedInAFile) {
  FakeWorld world;
  const auto owner = world.recorder(continuous());
  owner->tick(0);
  owner->take_notices();
  constexpr std::size_t kEvents = 3 * Recorder::kMaxTriggers;
  for (std::size_t i = 0; i < kEvents; ++i) owner->trigger("again", 1000);
  const auto notices = owner->take_notices();
  EXPECT_EQ(notices.size(), Recorder::kMaxNotices + 1);
  EXPECT_THAT(notices.back(), HasSubstr("more like these"));
  EXPECT_THAT(owner->take_notices(), IsEmpty());
  owner->finish(2000);
  EXPECT_EQ(owner->figures().events, kEvents);
  const auto reader = world.open(world.names()[0]);
  EXPECT_EQ(reader.metadata(kTriggerRecord).size(), Recorder::kMaxTriggers);
}

// Tries dds_recorder: the margin is reached
TEST(Disk, RecordingEndsInOrderBeforeTheMarginIsTouched) {
  FakeWorld world;
  RecorderSettings settings = continuous();
  settings.zstd_level = 0;
  settings.chunk_bytes = 10'000;
  world.free_bytes = 1'500'000;  // 0.5 MB above the margin
  const auto owner = world.recorder(settings);
  Recorder& recorder = *owner;
  std::uint64_t given = 0;
  for (std::uint64_t i = 1; i <= 2000 && recorder.ended().empty(); ++i) {
    const auto now_ns = static_cast<core::Nanoseconds>(i) * 10 * core::kNsPerMillisecond;  // 100 kB/s
    recorder.take(world.sample(world.state, i, now_ns, std::vector<std::uint8_t>(1000)));
    recorder.tick(now_ns);
    given = i;
  }
  EXPECT_LT(given, 1000u) << "it stopped by itself";
  EXPECT_THAT(recorder.ended(), AllOf(HasSubstr("in order"), HasSubstr("margin_MB"), HasSubstr("/disk")));
  EXPECT_GT(world.free_bytes, 800'000u) << "others keep their space, but for what a second brings";
  EXPECT_TRUE(passes_check(*world.files.begin()->second)) << "finished, with its summary";
  EXPECT_EQ(world.open(world.names()[0]).metadata(kEndRecord).back().at("reason"), "disk margin");
}

// Tries dds_recorder: a write fails
TEST(Disk, AWriteThatFailsLeavesAFileThatCanBeReadAndIsTold) {
  FakeWorld world;
  RecorderSettings settings = continuous();
  settings.margin_bytes = 0;
  settings.zstd_level = 0;
  settings.chunk_bytes = 10'000;
  world.free_bytes = 100'000;
  const auto owner = world.recorder(settings);
  Recorder& recorder = *owner;
  recorder.tick(0);
  for (std::uint64_t i = 1; i <= 200; ++i)
    recorder.take(world.sample(world.state, i, static_cast<core::Nanoseconds>(i) * core::kNsPerMillisecond,
                               std::vector<std::uint8_t>(1000)));
  EXPECT_THAT(recorder.ended(), AllOf(HasSubstr("no space left on the fake disk"), HasSubstr("can be read")));
  const auto reader = world.open(world.names()[0]);
  EXPECT_FALSE(reader.complete());
  EXPECT_TRUE(reader.problems().empty());
  EXPECT_GT(numbers(reader, "state").size(), 60u);
  EXPECT_GT(recorder.figures().losses.unwritten, 90u);
}

// Tries dds_recorder: the margin is reached
TEST(Disk, OnEventWaitsForSpaceAndGoesOn) {
  FakeWorld world;
  const auto owner = world.recorder(on_event());
  Recorder& recorder = *owner;
  world.free_bytes = 10;
  recorder.tick(FakeWorld::kSecond);
  EXPECT_EQ(recorder.figures().state, RecorderState::kOutOfSpace);
  EXPECT_TRUE(recorder.ended().empty()) << "it stays";
  recorder.take(world.sample(world.state, 1, FakeWorld::kSecond));
  recorder.trigger("lost one", FakeWorld::kSecond);
  EXPECT_TRUE(world.files.empty());
  world.free_bytes = 1'000'000'000;
  recorder.tick(3 * FakeWorld::kSecond);
  recorder.trigger("kept one", 3 * FakeWorld::kSecond);
  recorder.finish(4 * FakeWorld::kSecond);
  ASSERT_EQ(world.files.size(), 1u);
  EXPECT_THAT(numbers(world.open(world.names()[0]), "state"), ElementsAre(1));
}

TEST(Flush, WhatAKilledRecorderCanLoseIsWhatCameSinceTheLastFlush) {
  FakeWorld world;
  const auto owner = world.recorder(continuous());
  Recorder& recorder = *owner;
  recorder.tick(0);
  for (std::uint64_t i = 1; i <= 50; ++i) {
    const auto now_ns = static_cast<core::Nanoseconds>(i) * 100 * core::kNsPerMillisecond;
    recorder.take(world.sample(world.state, i, now_ns));
    recorder.tick(now_ns);
    const auto there = numbers(world.open(world.names()[0]), "state").size();  // as a reader finds it now
    EXPECT_GE(there + 10, i) << "flush interval 1 s";
  }
  EXPECT_GE(world.files.begin()->second->syncs(), 1u) << "and to the disk itself every 5 s";
}

}  // namespace
}  // namespace phantom::dds_recorder

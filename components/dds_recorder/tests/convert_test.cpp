// info, check and convert on files.
#include "components/dds_recorder/convert.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "common/core/errors.hpp"
#include "common/dds/endpoints/cdr.hpp"
#include "components/dds_recorder/adapter/dds_adapter.hpp"
#include "components/dds_recorder/info.hpp"
#include "components/dds_recorder/session.hpp"
#include "components/dds_recorder/tests/fake_world.hpp"
#include "tests/support/files.hpp"

namespace phantom::dds_recorder {
namespace {

using testing::HasSubstr;

class Files : public testing::Test {
 protected:
  void SetUp() override {
    std::filesystem::create_directories(folder);
    RecorderSettings settings;
    settings.split_ns = 6 * FakeWorld::kSecond;
    settings.chunk_bytes = 4'000;
    const auto owner = world.recorder(settings);
    Recorder& recorder = *owner;
    recorder.tick(0);
    recorder.take(world.sample(world.brick, 1, 0, {1, 1}));
    for (std::uint64_t i = 0; i < 100; ++i) {
      const auto now_ns = static_cast<core::Nanoseconds>(i) * 100 * core::kNsPerMillisecond;
      recorder.take(
          world.sample(world.state, 1 + i + (i > 50 ? 7 : 0), now_ns, std::vector<std::uint8_t>(100)));
      if (i == 30) recorder.trigger("hit alert 3 (gripper)", now_ns);
      recorder.tick(now_ns);
    }
    recorder.finish(10 * FakeWorld::kSecond);
    for (const auto& [path, sink] : world.files) {
      const auto file = folder / std::filesystem::path(path).filename();
      std::ofstream(file, std::ios::binary)
          .write(reinterpret_cast<const char*>(sink->bytes().data()),
                 static_cast<std::streamsize>(sink->bytes().size()));
      files.push_back(file);
    }
    ASSERT_EQ(files.size(), 2u);
  }
  void TearDown() override { std::filesystem::remove_all(folder); }
  std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("dds_recorder_files_" + std::to_string(getpid()));
  FakeWorld world;
  std::vector<std::filesystem::path> files;
  std::ostringstream output;
};

TEST_F(Files, InfoTellsTopicsCountsRatesRangeEventsAndLosses) {
  EXPECT_EQ(run_info({folder}, false, output), 0);
  EXPECT_THAT(output.str(),
              AllOf(HasSubstr("state"), HasSubstr("T\n"), HasSubstr("event: hit alert 3 (gripper)"),
                    HasSubstr("2023-11-14 22:13:20.000 UTC"), HasSubstr("ended: split")));
  std::ostringstream json_text;
  EXPECT_EQ(run_info(files, true, json_text), 0);
  const auto json = nlohmann::json::parse(json_text.str());
  ASSERT_EQ(json.size(), 2u);
  EXPECT_EQ(json[0]["topics"]["state"]["samples"], 61);
  EXPECT_EQ(json[0]["topics"]["state"]["missing"], 7);
  EXPECT_NEAR(json[0]["topics"]["state"]["rate_hz"], 10.0, 0.5);
  EXPECT_EQ(json[0]["about"]["host"], "test");
  EXPECT_EQ(json[1]["topics"]["brick"]["carried_over"], 1);
  EXPECT_EQ(json[1]["ended"], "stopped");
  EXPECT_TRUE(json[1]["complete"]);
}

// Tries dds_recorder: a chunk is damaged
TEST_F(Files, CheckFindsAWrongByteAndSaysWhatHelps) {
  EXPECT_EQ(run_check(files, false, output), 0);
  EXPECT_THAT(output.str(), HasSubstr("all well"));
  std::fstream file(files[0], std::ios::in | std::ios::out | std::ios::binary);
  file.seekp(3000);
  file.put('!');
  file.close();
  std::ostringstream again;
  EXPECT_EQ(run_check(files, false, again), 1);
  EXPECT_THAT(again.str(), AllOf(HasSubstr("byte "), HasSubstr("convert")));
}

TEST_F(Files, ConvertJoinsASeriesIntoOneFileThatIsWhole) {
  const auto out = folder / "all.mcap";
  EXPECT_EQ(run_convert({.files = files, .out = out}, output), 0);
  EXPECT_TRUE(recording::check(out)->ok());
  const auto opened = open_recordings({out});
  EXPECT_EQ(numbers(opened[0].reader, "state").size(), 100u);
  EXPECT_EQ(numbers(opened[0].reader, "brick").size(), 1u);
  EXPECT_EQ(opened[0].reader.channels().size(), 2u) << "the same topic and writer stay one channel";
  EXPECT_EQ(opened[0].reader.metadata(kTriggerRecord).size(), 1u);
  EXPECT_THROW(run_convert({.files = files, .out = out}, output), core::ConfigError)
      << "nothing is overwritten";
}

// Tries dds_recorder: it is killed
TEST_F(Files, ConvertMakesAWholeFileOfADamagedOne) {
  std::filesystem::resize_file(files[0], std::filesystem::file_size(files[0]) / 2);
  const auto out = folder / "mended.mcap";
  EXPECT_EQ(run_convert({.files = {files[0]}, .out = out}, output), 0);
  EXPECT_THAT(output.str(), HasSubstr("ends in the middle of a record"));
  EXPECT_TRUE(recording::check(out)->ok());
  EXPECT_GT(numbers(open_recordings({out})[0].reader, "state").size(), 10u);
}

// Tries dds_recorder: has a compression that is not read
// As other tools write: with lz4, or a name of tomorrow.
TEST_F(Files, ChunksThatCannotBeReadEndAConversionWithAFailure) {
  std::string bytes = test::text_of(files[0]);
  std::size_t changed = 0;
  const std::string as_it_is("\4\0\0\0zstd", 8);
  for (std::size_t at = bytes.find(as_it_is); at != std::string::npos; at = bytes.find(as_it_is, at + 1)) {
    bytes.replace(at, 8, std::string("\4\0\0\0lz4x", 8));
    if (++changed == 1) {  // the first chunk alone
      std::ofstream(folder / "some.mcap", std::ios::binary) << bytes;
    }
  }
  ASSERT_GT(changed, 2U);
  std::ofstream(folder / "none.mcap", std::ios::binary) << bytes;

  EXPECT_EQ(run_convert({.files = {folder / "some.mcap"}, .out = folder / "rest.mcap"}, output), 1);
  EXPECT_THAT(output.str(), AllOf(HasSubstr("is compressed with 'lz4x'; readable: zstd, none"),
                                  HasSubstr("1 chunks could not be read; ")));
  EXPECT_GT(numbers(open_recordings({folder / "rest.mcap"})[0].reader, "state").size(), 0U);
  // The brick's chunk is too small to be compressed.
  for (const char* out : {"nothing.mcap", "nothing.jsonl"}) {
    ConvertRequest request{.files = {folder / "none.mcap"}, .out = folder / out};
    request.topics = {"state"};
    EXPECT_THROW(run_convert(request, output), std::runtime_error);
    EXPECT_FALSE(std::filesystem::exists(folder / out)) << output.str();
  }
}

TEST_F(Files, ConvertTakesAPartWithTheStateThatHoldsInIt) {
  const auto out = folder / "part.mcap";
  ConvertRequest request{.files = files, .out = out};
  request.range = {2.0, 3.0};
  EXPECT_EQ(run_convert(request, output), 0);
  const auto opened = open_recordings({out});
  EXPECT_EQ(numbers(opened[0].reader, "state").size(), 10u);
  EXPECT_EQ(numbers(opened[0].reader, "brick").size(), 1u);
}

TEST_F(Files, WhereNothingIsWantedNothingIsWritten) {
  for (const char* out : {"nothing.mcap", "nothing.jsonl"}) {
    ConvertRequest request{.files = files, .out = folder / out};
    request.topics = {"nosuch"};
    EXPECT_THROW(run_convert(request, output), std::runtime_error);
    request.topics = {};
    request.range = {20.0, 10.0};
    EXPECT_THROW(run_convert(request, output), core::ConfigError);
    EXPECT_FALSE(std::filesystem::exists(folder / out));
  }
}

TEST(RecorderFolder, IsCheckedBeforeItIsMade) {
  const std::filesystem::path folder = test::new_folder();
  Config config;
  config.recorder.margin_bytes = 1;
  config.recorder.folder = folder / "new" / "deep";
  EXPECT_NO_THROW(check_folder(config));
  EXPECT_FALSE(std::filesystem::exists(folder / "new")) << "nothing is made";
  std::ofstream(folder / "file") << "text";
  config.recorder.folder = folder / "file" / "below";
  EXPECT_THROW(check_folder(config), core::MissingError);
  config.recorder.folder = folder;
  config.recorder.margin_bytes = std::uint64_t{1} << 62;
  EXPECT_THROW(check_folder(config), core::MissingError);
}

TEST(RecorderTopics, PlainNamesThatNoTopicHasAreKnown) {
  EXPECT_THAT(unknown_names({"percept", "percpt", "*_state", "!master_*", "rt/joint_states"}),
              testing::ElementsAre("percpt", "rt/joint_states"));
}

TEST_F(Files, ConvertToJsonDecodesTheProjectsTypes) {
  msg::OperatorCommand command;
  command.kind(msg::CommandKind::COMMAND_SET_PERCEPT_GAIN);
  command.value(2.5);
  command.issuer("me");
  std::vector<std::uint8_t> bytes;
  ASSERT_TRUE(dds::CdrCodec(dds::kOperatorCommand).encode(&command, bytes));
  FakeWorld other;
  const auto owner = other.recorder({});
  Recorder& recorder = *owner;
  const TopicNumber topic = recorder.add_topic(
      {"operator_command", dds::kOperatorCommand.type_name, false, false, "omgidl", "", {}});
  recorder.tick(0);
  recorder.take(other.sample(topic, 1, core::kNsPerMillisecond, bytes));
  recorder.take(other.sample(other.state, 1, core::kNsPerMillisecond));
  recorder.finish(FakeWorld::kSecond);
  const auto file = folder / "commands.mcap", out = folder / "commands.jsonl";
  const auto& sink = other.files.begin()->second->bytes();
  std::ofstream(file, std::ios::binary)
      .write(reinterpret_cast<const char*>(sink.data()), static_cast<std::streamsize>(sink.size()));
  EXPECT_EQ(run_convert({.files = {file}, .out = out}, output), 0);
  std::ifstream lines(out);
  std::string line;
  ASSERT_TRUE(std::getline(lines, line));
  const auto json = nlohmann::json::parse(line);
  EXPECT_EQ(json["topic"], "operator_command");
  EXPECT_EQ(json["sample"]["value"], 2.5);
  EXPECT_EQ(json["sample"]["issuer"], "me");
  ASSERT_TRUE(std::getline(lines, line));
  EXPECT_EQ(nlohmann::json::parse(line)["bytes"], 3) << "a type that is not known is told by its size";
}

TEST_F(Files, WhatIsMissingOrNoRecordingIsNamed) {
  EXPECT_THROW(run_info({"/nowhere/x.mcap"}, false, output), core::MissingError);
  std::filesystem::create_directories(folder / "empty");
  EXPECT_THROW(run_info({folder / "empty"}, false, output), core::MissingError);
  std::ofstream(folder / "text.mcap") << "this is no recording";
  EXPECT_THROW(run_info({folder / "text.mcap"}, false, output), core::ConfigError);
  EXPECT_THROW(run_convert({.files = files, .out = folder / "x.bag"}, output), core::ConfigError);
}

}  // namespace
}  // namespace phantom::dds_recorder

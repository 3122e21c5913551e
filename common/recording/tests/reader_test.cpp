// Ranges, filters, files of other tools.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <functional>
#include <utility>

#include "common/recording/mcap_check.hpp"
#include "common/recording/mcap_reader.hpp"
#include "common/recording/tests/literal_reader.hpp"

namespace phantom::recording {
namespace {

TEST(Reader, GivesTheMessagesOfARangeAndOfChosenChannels) {
  const Example made = example(3000, {.chunk_bytes = 5000});
  const auto reader = open(made.bytes);
  const std::uint64_t from = made.samples[800].log_time_ns, until = made.samples[2100].log_time_ns;
  std::vector<Sample> expected;
  for (const Sample& s : made.samples) {
    if (s.log_time_ns >= from && s.log_time_ns < until && (s.channel == 1 || s.channel == 3))
      expected.push_back(s);
  }
  std::stable_sort(expected.begin(), expected.end(),
                   [](const auto& a, const auto& b) { return a.log_time_ns < b.log_time_ns; });
  EXPECT_EQ(all_messages(*reader,
                         {[](const Channel& c) { return c.id == 1 || c.topic == "foreign"; }, from, until}),
            expected);
  EXPECT_TRUE(all_messages(*reader, {[](const Channel&) { return false; }, 0, ~0ULL}).empty());
  EXPECT_TRUE(all_messages(*reader, {{}, until, from}).empty());
}

// Another tool's file: messages outside of chunks, then a chunk that brings its own schema and channel, then
// such again.
TEST(Reader, ReadsMessagesOutsideOfChunksAndChannelsInside) {
  Bytes file(kMagic.begin(), kMagic.end()), inner;
  append(file, Header{"", "other"});
  append(file, Channel{4, 0, "a", "json", {}});
  const Bytes data{'{', '}'};
  append(file, Message{4, 1, 30, 30, data});
  append(file, Message{4, 2, 10, 10, data});
  append(inner, Schema{9, "S", "jsonschema", {}});
  append(inner, Channel{5, 9, "b", "json", {}});
  append(inner, Message{5, 1, 20, 20, data});
  append(file, Chunk{20, 20, inner.size(), 0, "", inner});
  append(file, Message{5, 2, 40, 40, data});
  for (const bool finished : {false, true}) {
    if (finished) {
      append(file, DataEnd{0});
      append(file, Footer{0, 0, 0});
      file.insert(file.end(), kMagic.begin(), kMagic.end());
    }
    const auto reader = open(file);
    ASSERT_TRUE(reader);
    EXPECT_TRUE(reader->problems().empty());
    std::vector<std::uint64_t> times;
    for (const Sample& s : all_messages(*reader)) times.push_back(s.log_time_ns);
    EXPECT_EQ(times, (std::vector<std::uint64_t>{10, 20, 30, 40}));
    EXPECT_EQ(reader->statistics().message_count, 4u);
    EXPECT_EQ(reader->channels().at(5).topic, "b");
    EXPECT_EQ(LiteralReader(file).read().samples.size(), 4u);
  }
}

TEST(Reader, RefusesWhatIsNoMcap) {
  EXPECT_FALSE(open(Bytes{}));
  EXPECT_FALSE(open(Bytes{'P', 'K', 3, 4, 0, 0, 0, 0, 0}));
  const Bytes magic_alone(kMagic.begin(), kMagic.end());
  EXPECT_FALSE(open(magic_alone));
  const auto missing = McapReader::open(std::filesystem::path("/nowhere/x.mcap"));
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.status().code(), core::ErrorCode::kNotFound);
  EXPECT_NE(missing.status().message().find("/nowhere/x.mcap"), std::string::npos);
}

TEST(Reader, ARecordOrChunkBeyondTheLimitsTakesNoMemory) {
  const Example made = example(500, {.chunk_bytes = 20000});
  const auto reader = open(made.bytes, {.record_bytes = 1 << 20, .chunk_bytes = 10000});
  ASSERT_TRUE(reader) << "the summary is small";
  MessageCursor cursor(*reader);
  Message message;
  std::size_t got = 0;
  while (cursor.next(message)) ++got;
  EXPECT_LT(got, made.samples.size());
  ASSERT_FALSE(cursor.problems().empty());
  EXPECT_NE(cursor.problems()[0].find("allowed: 10000"), std::string::npos) << cursor.problems()[0];

  Bytes claims(kMagic.begin(), kMagic.end());
  append(claims, Header{});
  claims.push_back(0x06);
  for (int i = 0; i < 8; ++i) claims.push_back(0xff);
  const auto claiming = open(claims);
  ASSERT_TRUE(claiming);
  EXPECT_EQ(claiming->problems().size(), 1u);
}

TEST(Reader, AnUnknownCompressionIsNamed) {
  Bytes file(kMagic.begin(), kMagic.end());
  append(file, Header{});
  const Bytes packed = file;
  append(file, Chunk{1, 2, 3, 4, "lz4", packed});
  const auto reader = open(file);
  ASSERT_TRUE(reader);
  ASSERT_EQ(reader->problems().size(), 1u);
  EXPECT_NE(reader->problems()[0].find("'lz4'; readable: zstd, none"), std::string::npos)
      << reader->problems()[0];
}

TEST(FileSinkAndSource, KeepWhatWasWrittenAndRefuseToOverwrite) {
  const auto path =
      std::filesystem::temp_directory_path() / ("phantom_sink_" + std::to_string(getpid()) + ".mcap");
  std::filesystem::remove(path);
  const Example made = example(300, {});
  {
    auto sink = FileSink::create(path);
    ASSERT_TRUE(sink) << sink.status().message();
    ASSERT_TRUE((*sink)->write(made.bytes));
    ASSERT_TRUE((*sink)->sync());
    const auto again = FileSink::create(path);
    ASSERT_FALSE(again);
    EXPECT_EQ(again.status().code(), core::ErrorCode::kFailedPrecondition);
  }
  const auto reader = McapReader::open(path);
  ASSERT_TRUE(reader);
  EXPECT_TRUE(reader->complete());
  EXPECT_EQ(all_messages(*reader).size(), 300u);
  EXPECT_TRUE(check(path)->ok());
  std::filesystem::remove(path);
  EXPECT_FALSE(FileSink::create("/nowhere/at/all.mcap"));
}

// Tries dds_recorder: its file is removed or cut by others
TEST(FileSinkAndSource, AFileThatOthersRemoveOrCutFailsTheNextWriteAndSync) {
  const auto path =
      std::filesystem::temp_directory_path() / ("phantom_gone_" + std::to_string(getpid()) + ".mcap");
  const Bytes bytes(100, 7);
  for (const auto& [what, harm] :
       {std::pair<const char*, std::function<void()>>{"was removed", [&] { std::filesystem::remove(path); }},
        {"it has 50 bytes instead of 100", [&] { std::filesystem::resize_file(path, 50); }},
        {"it has 0 bytes instead of 100", [&] { std::ofstream(path, std::ios::trunc); }}}) {
    auto sink = FileSink::create(path);
    ASSERT_TRUE(sink) << sink.status().message();
    ASSERT_TRUE((*sink)->write(bytes));
    harm();
    for (const core::Status& status : {(*sink)->write(bytes), (*sink)->sync()}) {
      EXPECT_EQ(status.code(), core::ErrorCode::kUnavailable);
      EXPECT_NE(status.message().find(what), std::string::npos) << status.message();
    }
    std::filesystem::remove(path);
  }
}

}  // namespace
}  // namespace phantom::recording

// What the writer leaves is what was given to it: by its own reader, by the literal twin, and at every
// moment.
#include <gtest/gtest.h>

#include <algorithm>

#include "common/recording/mcap_check.hpp"
#include "common/recording/mcap_writer.hpp"
#include "common/recording/tests/literal_reader.hpp"

namespace phantom::recording {
namespace {

std::vector<Sample> by_time(std::vector<Sample> samples) {
  std::stable_sort(samples.begin(), samples.end(),
                   [](const auto& a, const auto& b) { return a.log_time_ns < b.log_time_ns; });
  return samples;
}

class Written : public testing::TestWithParam<WriterOptions> {};

TEST_P(Written, ComesBackThroughTheReaderInTheOrderOfTime) {
  const Example made = example(2000, GetParam());
  const auto reader = open(made.bytes);
  ASSERT_TRUE(reader) << reader.status().message();
  EXPECT_TRUE(reader->complete());
  EXPECT_TRUE(reader->problems().empty());
  EXPECT_EQ(all_messages(*reader), by_time(made.samples));
  EXPECT_EQ(reader->statistics().message_count, made.samples.size());
  EXPECT_EQ(reader->channels().size(), 4u);
  EXPECT_EQ(reader->channels().at(1).metadata.at("writer"), "w");
  EXPECT_EQ(reader->schemas().at(2).name, "S1");
  const auto losses = reader->metadata("losses");
  ASSERT_EQ(losses.size(), 40u);
  EXPECT_EQ(losses.back().at("total"), "1999");
  ASSERT_EQ(reader->attachment_indexes().size(), 1u);
  EXPECT_EQ(reader->read(reader->attachment_indexes()[0])->data, (Bytes{'a', ':', '1'}));
}

TEST_P(Written, ComesBackThroughTheLiteralReaderInTheOrderOfWriting) {
  const Example made = example(2000, GetParam());
  const LiteralFile file = LiteralReader(made.bytes).read();
  EXPECT_TRUE(file.ended);
  EXPECT_EQ(file.samples, made.samples);
  EXPECT_EQ(file.topics.at(3), "foreign");
  EXPECT_EQ(file.schema_texts.at(1), "struct S0 { double x; };");
  EXPECT_EQ(file.metadata_names.size(), 40u);
}

TEST_P(Written, PassesTheCheck) {
  const Example made = example(2000, GetParam());
  const auto report = check(std::make_unique<MemorySource>(made.bytes));
  ASSERT_TRUE(report);
  EXPECT_TRUE(report->ok()) << report->problems[0];
  EXPECT_EQ(report->messages, 2000u);
}

INSTANTIATE_TEST_SUITE_P(Every, Written,
                         testing::Values(WriterOptions{.chunk_bytes = 1 << 14, .zstd_level = 1},
                                         WriterOptions{.chunk_bytes = 1 << 14, .zstd_level = 0},
                                         WriterOptions{.chunk_bytes = 1, .zstd_level = 3},
                                         WriterOptions{.chunk_bytes = 1 << 24, .zstd_level = 19}));

TEST(Writer, AFileWithoutMessagesIsWhole) {
  const Example made = example(0, {});
  const auto reader = open(made.bytes);
  ASSERT_TRUE(reader);
  EXPECT_TRUE(reader->complete());
  EXPECT_TRUE(all_messages(*reader).empty());
  EXPECT_TRUE(check(std::make_unique<MemorySource>(made.bytes))->ok());
}

TEST(Writer, EndChunkMakesAllThatWasWrittenReadable) {
  MemorySink sink;
  McapWriter writer(sink, {});
  const auto channel = writer.add_channel({0, 0, "t", "cdr", {}});
  const Bytes data{1};
  ASSERT_TRUE(writer.write(Message{*channel, 1, 10, 10, data}));
  EXPECT_TRUE(all_messages(*open(sink.bytes())).empty()) << "still in the chunk";
  ASSERT_TRUE(writer.end_chunk());
  EXPECT_EQ(all_messages(*open(sink.bytes())).size(), 1u);
  const auto size = sink.bytes().size();
  ASSERT_TRUE(writer.end_chunk());
  EXPECT_EQ(sink.bytes().size(), size) << "an empty chunk is none";
}

TEST(Writer, WhatIsNotInTheFileIsRefused) {
  MemorySink sink;
  McapWriter writer(sink, {});
  EXPECT_FALSE(writer.add_channel({0, 1, "t", "cdr", {}}));
  EXPECT_FALSE(writer.write(Message{0, 1, 10, 10, {}}));
  ASSERT_TRUE(writer.finish());
  EXPECT_FALSE(writer.write(Metadata{"late", {}}));
  EXPECT_TRUE(check(std::make_unique<MemorySource>(sink.bytes()))->ok()) << "nothing was added after the end";
}

// Every room from nothing to all: the first failure stays, and what is in the sink can be read.
// Tries dds_recorder: a write fails
TEST(Writer, ADiskThatFillsLeavesWhatWasWrittenReadable) {
  const WriterOptions options{.chunk_bytes = 400};
  const Example whole = example(60, options);
  std::size_t most = 0;
  for (std::size_t room = whole.ends[0]; room < whole.bytes.size(); room += 37) {
    MemorySink sink(room);
    McapWriter writer(sink, options);
    core::Status failed;
    const auto note = [&](const core::Status& status) {
      if (failed && !status) failed = status;
    };
    for (int i = 0; i < 4; ++i) {
      const auto added = writer.add_channel({0, 0, "topic_" + std::to_string(i), "cdr", {}});
      if (!added) note(added.status());
    }
    if (failed) {
      for (const Sample& sample : whole.samples) note(writer.write(sample.message()));
    }
    note(writer.finish());
    if (failed) continue;  // it was enough: fewer records than in the example
    EXPECT_EQ(writer.status().code(), core::ErrorCode::kResourceExhausted);
    const auto reader = open(sink.bytes());
    ASSERT_TRUE(reader);
    EXPECT_TRUE(reader->problems().empty()) << "no half of a record is left";
    const auto got = all_messages(*reader);
    EXPECT_GE(got.size(), most) << "more room, no less is kept";
    most = got.size();
  }
  EXPECT_GT(most, 20u);
}

}  // namespace
}  // namespace phantom::recording

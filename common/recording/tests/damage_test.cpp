// A file that ends anywhere, or in which any byte is wrong: every whole chunk can be read, and nothing is
// invented.
#include <gtest/gtest.h>

#include <algorithm>

#include "common/recording/mcap_check.hpp"
#include "common/recording/tests/memory_file.hpp"

namespace phantom::recording {
namespace {

const WriterOptions kSmallChunks{.chunk_bytes = 300};

/// Where each chunk ends, and how many messages the chunks up to it hold: found by walking the records.
std::vector<std::pair<std::size_t, std::size_t>> chunk_ends(const Bytes& bytes) {
  std::vector<std::pair<std::size_t, std::size_t>> ends;
  std::size_t messages = 0;
  RecordView view;
  for (std::size_t at = kMagic.size(); next_record(ByteView(bytes).subspan(at), view); at += view.size()) {
    if (view.opcode == Opcode::kDataEnd) break;
    if (view.opcode != Opcode::kChunk) continue;
    Chunk chunk;
    EXPECT_TRUE(parse(view.content, chunk));
    // The indexes that follow say how many messages it holds.
    RecordView index_view;
    for (std::size_t i = at + view.size();
         next_record(ByteView(bytes).subspan(i), index_view) && index_view.opcode == Opcode::kMessageIndex;
         i += index_view.size()) {
      MessageIndex index;
      EXPECT_TRUE(parse(index_view.content, index));
      messages += index.records.size();
    }
    ends.emplace_back(at + view.size(), messages);
  }
  return ends;
}

TEST(Damage, AFileCutAtAnyByteGivesEveryWholeChunk) {
  const Example made = example(120, kSmallChunks);
  const auto ends = chunk_ends(made.bytes);
  ASSERT_GT(ends.size(), 10u);
  ASSERT_EQ(ends.back().second, made.samples.size());
  const std::size_t header_end = made.ends[0];
  for (std::size_t cut = 0; cut < made.bytes.size(); ++cut) {
    const ByteView part = ByteView(made.bytes).first(cut);
    const auto reader = open(part);
    ASSERT_EQ(reader.has_value(), cut >= header_end) << cut;
    if (!reader) continue;
    EXPECT_FALSE(reader->complete()) << cut;
    std::size_t expected = 0;
    for (const auto& [end, messages] : ends) expected = end <= cut ? messages : expected;
    auto got = all_messages(*reader);
    ASSERT_EQ(got.size(), expected) << cut;
    EXPECT_EQ(reader->statistics().message_count, expected);
    std::sort(got.begin(), got.end(), [](const auto& a, const auto& b) { return a.sequence < b.sequence; });
    ASSERT_TRUE(std::equal(got.begin(), got.end(), made.samples.begin())) << cut;
    if (cut % 7 == 0) {
      EXPECT_FALSE(check(std::make_unique<MemorySource>(part))->ok()) << cut;
    }
  }
}

TEST(Damage, AnyWrongByteIsFoundByTheCheckAndInventsNoMessage) {
  const Example made = example(60, kSmallChunks);
  for (std::size_t at = 0; at < made.bytes.size(); ++at) {
    Bytes bytes = made.bytes;
    bytes[at] ^= 0x20;
    const auto report =
        check(std::make_unique<MemorySource>(bytes), {.record_bytes = 1 << 20, .chunk_bytes = 1 << 20});
    EXPECT_TRUE(!report || !report->ok()) << "byte " << at;
    const auto reader = open(bytes, {.record_bytes = 1 << 20, .chunk_bytes = 1 << 20});
    if (!reader) continue;
    for (const Sample& sample : all_messages(*reader)) {
      ASSERT_LT(sample.sequence, made.samples.size());
      ASSERT_EQ(sample, made.samples[sample.sequence]) << "byte " << at;
    }
  }
}

// Tries dds_recorder: a chunk is damaged
TEST(Damage, ADamagedChunkTakesOnlyItsOwnMessagesAlong) {
  const Example made = example(200, kSmallChunks);
  const auto ends = chunk_ends(made.bytes);
  Bytes bytes = made.bytes;
  bytes[ends[5].first - 10] ^= 0xff;  // the end of the sixth chunk's data
  const auto reader = open(bytes);
  ASSERT_TRUE(reader);
  MessageCursor cursor(*reader);
  std::size_t got = 0;
  for (Message message; cursor.next(message);) ++got;
  EXPECT_EQ(got, made.samples.size() - (ends[5].second - ends[4].second));
  ASSERT_EQ(cursor.problems().size(), 1u);
  EXPECT_NE(cursor.problems()[0].find("byte "), std::string::npos);
}

}  // namespace
}  // namespace phantom::recording

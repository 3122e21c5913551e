// The check finds what the checksums alone would not: a file that is whole but says something untrue.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/recording/mcap_check.hpp"
#include "common/recording/tests/memory_file.hpp"

namespace phantom::recording {
namespace {

using testing::Contains;
using testing::HasSubstr;

/// A file of one chunk with one message, put together by hand; `change` may spoil the parts before they are
/// joined.
struct Parts {
  Bytes data{1, 2, 3};
  Channel channel{0, 0, "t", "cdr", {}};
  Chunk chunk{};
  Bytes inner;
  MessageIndex index{0, {{10, 0}}};
  Statistics statistics{1, 0, 1, 0, 0, 1, 10, 10, {{0, 1}}};
};

std::vector<std::string> problems(const std::function<void(Parts&)>& change) {
  Parts parts;
  append(parts.inner, Message{0, 1, 10, 10, parts.data});
  parts.chunk = Chunk{10, 10, parts.inner.size(), crc32(parts.inner), "", parts.inner};
  change(parts);
  Bytes file(kMagic.begin(), kMagic.end());
  append(file, Header{});
  append(file, parts.channel);
  const std::uint64_t chunk_at = file.size();
  append(file, parts.chunk);
  const std::uint64_t chunk_length = file.size() - chunk_at;
  append(file, parts.index);
  append(file, DataEnd{0});
  const std::uint64_t summary_at = file.size();
  append(file, parts.channel);
  append(file, parts.statistics);
  append(file, ChunkIndex{10, 10, chunk_at, chunk_length, {}, 0, "", parts.inner.size(), parts.inner.size()});
  append(file, Footer{summary_at, 0, 0});
  file.insert(file.end(), kMagic.begin(), kMagic.end());
  const auto report = check(std::make_unique<MemorySource>(file));
  EXPECT_TRUE(report);
  return report->problems;
}

TEST(Check, AnHonestFileHasNoProblems) {
  EXPECT_THAT(problems([](Parts&) {}), testing::IsEmpty());
}

TEST(Check, UntrueTimesIndexesAndCountsAreFound) {
  EXPECT_THAT(problems([](Parts& p) { p.chunk.message_end_time_ns = 11; }),
              Contains(HasSubstr("claims other times")));
  EXPECT_THAT(problems([](Parts& p) { p.index.records[0].second = 1; }),
              Contains(HasSubstr("not in its chunk")));
  EXPECT_THAT(problems([](Parts& p) { p.index.records.clear(); }), Contains(HasSubstr("in no index")));
  EXPECT_THAT(problems([](Parts& p) { p.statistics.message_count = 2; }), Contains(HasSubstr("statistics")));
  EXPECT_THAT(problems([](Parts& p) { p.chunk.uncompressed_crc ^= 1; }), Contains(HasSubstr("checksum")));
  EXPECT_THAT(problems([](Parts& p) { p.channel.schema_id = 3; }), Contains(HasSubstr("names a schema")));
  EXPECT_THAT(problems([](Parts& p) { p.channel.id = 1; }), Contains(HasSubstr("names a channel")));
}

}  // namespace
}  // namespace phantom::recording

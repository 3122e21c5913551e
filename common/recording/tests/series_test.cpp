// Several recordings as one.
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>

#include "common/recording/series_cursor.hpp"
#include "common/recording/tests/memory_file.hpp"

namespace phantom::recording {
namespace {

class Series : public testing::Test {
 protected:
  Series() { std::filesystem::create_directories(folder_); }
  ~Series() override { std::filesystem::remove_all(folder_); }
  std::filesystem::path write(const std::string& name, const Bytes& bytes) {
    std::ofstream(folder_ / name, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    return folder_ / name;
  }
  const std::filesystem::path folder_ =
      std::filesystem::path(testing::TempDir()) / ("series_" + std::to_string(getpid()));
};

TEST_F(Series, ComesInTheOrderOfTimeWhereverTheReadingBegins) {
  // The files overlap, as Example begins all at the same time.
  std::vector<std::filesystem::path> files;
  for (unsigned seed = 1; seed <= 3; ++seed)
    files.push_back(
        write(std::to_string(seed) + ".mcap", example(400 * seed, {.chunk_bytes = 2000}, seed).bytes));
  const auto recordings = open_recordings(files);
  using Found = std::vector<std::pair<std::size_t, Sample>>;
  Found expected;
  for (std::size_t i = 0; i < recordings.size(); ++i) {
    for (Sample& sample : all_messages(recordings[i].reader)) expected.emplace_back(i, std::move(sample));
  }
  std::ranges::stable_sort(expected, {}, [](const auto& found) { return found.second.log_time_ns; });
  for (const std::uint64_t skip : {0U, 3U, 700U, 1500U, 2399U}) {
    MessageFilter filter;
    filter.from_ns = expected[skip].second.log_time_ns;
    Found found;
    SeriesCursor cursor(recordings, filter);
    for (auto next = cursor.peek(); next.message != nullptr; cursor.pop(), next = cursor.peek())
      found.emplace_back(next.recording, sample_of(*next.message));
    Found wanted;
    for (const auto& one : expected)
      if (one.second.log_time_ns >= filter.from_ns) wanted.push_back(one);
    EXPECT_EQ(found, wanted) << skip;
    EXPECT_TRUE(cursor.problems().empty());
  }
}

TEST_F(Series, ChunksThatAllOverlapTakeNoMoreThanTheLimit) {
  MemorySink sink;
  McapWriter writer(sink, {.chunk_bytes = 1 << 20});
  const auto channel = *writer.add_channel({0, 0, "t", "cdr", {}});
  constexpr std::uint32_t kChunks = 40;
  for (std::uint32_t i = 0; i < kChunks; ++i) {  // each chunk says that it reaches over all
    for (const std::uint64_t at_ns : {std::uint64_t{1'000 + i}, std::uint64_t{2'000'000 + i}})
      ASSERT_TRUE(writer.write(Message{channel, i, at_ns, at_ns, Bytes(400'000)}));
    ASSERT_TRUE(writer.end_chunk());
  }
  ASSERT_TRUE(writer.finish());
  const auto file = write("bomb.mcap", sink.bytes());
  const auto bounded = open_recordings({file}, {.overlap_bytes = 5'000'000});
  MessageCursor cursor(bounded[0].reader);
  std::size_t count = 0;
  for (Message message; cursor.next(message);) ++count;
  EXPECT_EQ(count, 2U * (kChunks - cursor.problems().size()));
  EXPECT_LE(count, 14U);
  ASSERT_FALSE(cursor.problems().empty());
  EXPECT_NE(cursor.problems().front().find("too many chunks overlap in time"), std::string::npos);
  EXPECT_EQ(all_messages(open_recordings({file})[0].reader).size(), 2U * kChunks);
}

}  // namespace
}  // namespace phantom::recording

// Queue, durable state, IDL text, configuration.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cstring>
#include <fstream>
#include <thread>

#include "common/core/errors.hpp"
#include "components/dds_recorder/adapter/known_topics.hpp"
#include "components/dds_recorder/config.hpp"
#include "components/dds_recorder/idl_text.hpp"
#include "components/dds_recorder/processes.hpp"
#include "components/dds_recorder/sample_queue.hpp"
#include "components/dds_recorder/tests/fake_world.hpp"
#include "tests/support/heap_guard.hpp"

namespace phantom::dds_recorder {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

// Tries dds_recorder: the disk is slow; too many samples
TEST(Queue, KeepsOrderAndBytesAndRefusesWhatHasNoRoomWithoutTheHeap) {
  FakeWorld world;
  SampleQueue queue(20'000);
  std::uint64_t refused = 0;
  for (std::uint64_t i = 1; i <= 50; ++i) {
    const SampleView sample =
        world.sample(3, i, 5, std::vector<std::uint8_t>(i * 10, static_cast<std::uint8_t>(i)));
    const test::HeapGuard guard;
    refused += queue.push(sample) ? 0 : 1;
  }
  EXPECT_GT(refused, 0u);
  std::uint64_t got = 0;
  queue.drain([&](const SampleView& sample) {
    ++got;
    EXPECT_EQ(sample.head.sequence_number, got) << "the oldest are kept, in order";
    EXPECT_EQ(sample.head.topic, 3u);
    ASSERT_EQ(sample.bytes.size(), got * 10);
    EXPECT_EQ(sample.bytes.back(), static_cast<std::uint8_t>(got));
  });
  EXPECT_EQ(got + refused, 50u);
  EXPECT_TRUE(queue.push(world.sample(3, 51, 5))) << "there is room again";
}

TEST(Queue, ManyThreadsFillItWhileOneDrains) {
  SampleQueue queue(1'000'000);
  constexpr std::uint64_t kEach = 20'000;
  std::atomic<std::uint64_t> refused{0};
  std::vector<std::jthread> writers;
  std::atomic<int> running{4};
  for (std::uint8_t writer = 0; writer < 4; ++writer) {
    writers.emplace_back([&, writer] {
      std::vector<std::uint8_t> bytes(100, writer);
      SampleHead head;
      head.writer[0] = writer;
      for (head.sequence_number = 1; head.sequence_number <= kEach; ++head.sequence_number) {
        if (!queue.push({head, bytes})) ++refused;
      }
      --running;
    });
  }
  std::array<std::uint64_t, 4> last{};
  std::uint64_t got = 0;
  const auto take = [&](const SampleView& sample) {
    const std::uint8_t writer = sample.head.writer[0];
    EXPECT_GT(sample.head.sequence_number, last[writer]);
    EXPECT_EQ(sample.bytes[99], writer);
    last[writer] = sample.head.sequence_number;
    ++got;
  };
  while (running > 0) {
    queue.wait(0.01);
    queue.drain(take);
  }
  queue.drain(take);
  queue.drain(take);
  EXPECT_EQ(got + refused, 4 * kEach) << "every sample is either there or counted";
}

TEST(DurableStateOf, KeepsTheNewestOfEachInstanceWithinItsMemory) {
  FakeWorld world;
  DurableState state(world.ports().instance_of, 50'000);
  for (std::uint64_t i = 1; i <= 30; ++i)
    state.put(owned(world.sample(0, i, 0, {static_cast<std::uint8_t>(i % 3), 9})), true);
  std::vector<std::uint64_t> kept;
  state.for_each([&](const Sample& sample) { kept.push_back(sample.head.sequence_number); });
  EXPECT_THAT(kept, ElementsAre(28, 29, 30));
  for (std::uint64_t i = 31; i <= 100; ++i) {
    std::vector<std::uint8_t> bytes(1000);
    bytes[0] = static_cast<std::uint8_t>(i);
    state.put(owned(world.sample(0, i, 0, bytes)), true);
    EXPECT_LE(state.bytes(), 50'000u);
  }
  EXPECT_GT(state.forgotten(), 0u);
  DurableState unknown([](auto, auto, auto&) { return false; }, 50'000);
  for (std::uint64_t i = 1; i <= 5; ++i) unknown.put(owned(world.sample(0, i, 0)), true);
  EXPECT_EQ(unknown.size(), 5u) << "where the key is not known each sample counts";
}

TEST(DurableStateOf, SmallSamplesCountWithWhatKeepsThem) {
  FakeWorld world;
  constexpr std::size_t kLimit = 1'000'000, kMinOfOne = 250;  // of two nodes, a block and the sample itself
  DurableState state([](auto, auto, auto&) { return false; }, kLimit);
  for (std::uint64_t i = 1; i <= 100'000; ++i) state.put(owned(world.sample(0, i, 0, {1})), true);
  EXPECT_LE(state.size(), kLimit / kMinOfOne);
  EXPECT_EQ(state.size() + state.forgotten(), 100'000u) << "what is forgotten is counted";
}

TEST(KnownTopicsOf, EachIsFreshOnceAndOfThoseOfOthersThereAreSoMany) {
  KnownTopics known;
  known.add_own("percept");
  EXPECT_FALSE(known.is_fresh("percept"));
  for (std::size_t i = 0; i < 2 * KnownTopics::kMaxForeign; ++i)
    EXPECT_EQ(known.is_fresh("t" + std::to_string(i)), i < KnownTopics::kMaxForeign);
  EXPECT_FALSE(known.is_fresh("t0"));
  EXPECT_EQ(known.left_out(), KnownTopics::kMaxForeign);
}

TEST(ProcessesOf, ThoseThatAreThereAreKnownHoweverManyCameAndWent) {
  Processes processes;
  const auto process = [](std::uint64_t number) {
    diagnostics::ParticipantInfo info;
    std::memcpy(info.guid.data(), &number, sizeof number);
    info.guid = diagnostics::participant_of(info.guid);
    info.name = "p" + std::to_string(number);
    return info;
  };
  processes.put(process(7));
  for (std::uint64_t number = 100; number < 100 + 10 * Processes::kMaxGone; ++number) {
    processes.put(process(number));
    processes.leave(process(number).guid);
  }
  EXPECT_EQ(processes.size(), 1 + Processes::kMaxGone);
  Guid writer = process(7).guid;
  writer[15] = 0x02;
  EXPECT_EQ(processes.describe(writer).component, "p7");
  EXPECT_EQ(processes.describe(writer).partition, "");
  diagnostics::EndpointInfo endpoint;
  endpoint.guid = writer;
  endpoint.qos.partitions = {"cell/a"};
  processes.put(endpoint);
  processes.put(process(7));  // announced again
  EXPECT_EQ(processes.describe(writer).partition, "cell/a");
  const std::uint64_t last = 99 + 10 * Processes::kMaxGone;
  EXPECT_EQ(processes.describe(process(last).guid).component, "p" + std::to_string(last))
      << "its samples may not be written yet";
  EXPECT_EQ(processes.describe(process(100).guid).component, "");
}

TEST(IdlText, HoldsTheTypeAndAllThatItRefersToWithoutPreprocessor) {
  const std::string idl = idl_of("phantom::msg::DragField");
  EXPECT_THAT(idl, HasSubstr("struct DragField {"));
  EXPECT_THAT(idl, HasSubstr("typedef double JointArray[16];"));
  EXPECT_THAT(idl, HasSubstr("[N·m·s/rad]")) << "units stay";
  EXPECT_THAT(idl, Not(HasSubstr("#")));
  EXPECT_EQ(idl.find("struct Stamp {"), idl.rfind("struct Stamp {")) << "once";
  EXPECT_LT(idl.find("struct Stamp {"), idl.find("struct DragField {")) << "before its use";
  EXPECT_EQ(idl_of("other::Type"), "");
  EXPECT_EQ(idl_of("phantom::msg::Nothing"), "");
}

class ConfigFile : public testing::Test {
 protected:
  Config load(const std::string& yaml) {
    std::ofstream(path_) << yaml;
    return load_config(path_);
  }
  std::string problem(const std::string& yaml) {
    try {
      load(yaml);
    } catch (const core::ConfigError& error) {
      return error.what();
    }
    return "";
  }
  void TearDown() override { std::filesystem::remove(path_); }
  std::filesystem::path path_ =
      std::filesystem::temp_directory_path() / ("dds_recorder_" + std::to_string(getpid()) + ".yaml");
};

TEST_F(ConfigFile, TheShippedOneHoldsTheDefaults) {
  const Config shipped = load_config(PHANTOM_SOURCE_DIR "/components/dds_recorder/dds_recorder.yaml");
  const Config bare = load("folder: recordings\n");
  EXPECT_EQ(shipped.recorder.split_bytes, bare.recorder.split_bytes);
  EXPECT_EQ(shipped.recorder.before_ns, bare.recorder.before_ns);
  EXPECT_EQ(shipped.recorder.margin_bytes, bare.recorder.margin_bytes);
  EXPECT_EQ(shipped.recorder.flush_ns, bare.recorder.flush_ns);
  EXPECT_EQ(shipped.queue_bytes, bare.queue_bytes);
  EXPECT_FALSE(shipped.recorder.on_event);
  EXPECT_TRUE(shipped.topics.empty());
}

TEST_F(ConfigFile, WrongValuesAreNamedWithWhatIsAllowed) {
  EXPECT_THAT(problem("name: a/b\n"), AllOf(HasSubstr(":1"), HasSubstr("name"), HasSubstr("allowed")));
  EXPECT_THAT(problem("mode: sometimes\n"), AllOf(HasSubstr("mode"), HasSubstr("on_event")));
  EXPECT_THAT(problem("window: {before_s: -1}\n"), AllOf(HasSubstr("before_s"), HasSubstr("allowed")));
  EXPECT_THAT(problem("split: {size_GB: 1}\n"), AllOf(HasSubstr("size_GB"), HasSubstr("size_MB")));
  EXPECT_THAT(problem("compression_level: 40\n"), HasSubstr("compression_level"));
}

}  // namespace
}  // namespace phantom::dds_recorder

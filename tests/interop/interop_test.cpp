// Every topic of the project through another vendor's DDS, and back: read and written by Cyclone DDS from the
// same IDL.
#include <gtest/gtest.h>

#include <mutex>
#include <optional>
#include <vector>

#include "common/dds/endpoints/cdr.hpp"
#include "common/dds/endpoints/endpoint.hpp"
#include "common/dds/endpoints/topic_list.hpp"
#include "common/dds/tests/test_network.hpp"
#include "tests/interop/cyclone_mirror.hpp"
#include "tests/support/own_domain.hpp"
#include "tests/support/topic_samples.hpp"

namespace phantom::interop {
namespace {

// No two tests of this executable share a domain, nor do executables that run beside it.
core::NetworkOptions network(std::size_t which) {
  core::NetworkOptions options = dds::test_network();
  options.initial_peers = {"127.0.0.1"};
  options.participants_per_host = 30;
  options.domain = test::own_domain(which);
  return options;
}

class Interop : public testing::TestWithParam<const dds::TopicDescription*> {
 protected:
  // Ours are the same for all topics: after some sixty in one process Cyclone DDS does not find further ones.
  static void SetUpTestSuite() {
    sender_.emplace("sender", network(0));
    receiver_.emplace("receiver", network(1));
  }
  static void TearDownTestSuite() {
    sender_.reset();
    receiver_.reset();
  }
  static inline std::optional<dds::Participant> sender_, receiver_;
};

TEST_P(Interop, IsReadAndWrittenByAnotherVendorInEveryMember) {
  const dds::TopicDescription& topic = *GetParam();
  dds::CdrCodec codec(topic), codec_of_reader(topic);
  std::mutex mutex;
  std::vector<std::uint8_t> came;
  dds::RawReader reader(*receiver_, topic, [&](const void* sample, const dds::SampleInfo&) {
    const std::lock_guard lock(mutex);
    return codec_of_reader.encode(sample, came);
  });
  dds::RawWriter writer(*sender_, topic);
  CycloneMirror mirror(topic, network(0).domain, network(1).domain);
  ASSERT_TRUE(dds::eventually([&] {
    return mirror.connected() && writer.matched() == 1 && reader.matched() == 1;
  })) << "Fast DDS and Cyclone DDS did not agree on "
      << topic.name << ": type or QoS";

  test::with_sample(topic, [&](void* sample) {
    std::vector<std::uint8_t> sent;
    ASSERT_TRUE(codec.encode(sample, sent));
    // Best effort may lose one; what comes must be whole.
    EXPECT_TRUE(dds::eventually([&] {
      writer.write(sample);
      return dds::eventually(
          [&] {
            const std::lock_guard lock(mutex);
            return !came.empty();
          },
          std::chrono::seconds(1));
    })) << mirror.mirrored()
        << " samples went through Cyclone DDS";
    const std::lock_guard lock(mutex);
    EXPECT_EQ(came, sent);
  });
}

INSTANTIATE_TEST_SUITE_P(Topics, Interop,
                         testing::ValuesIn(dds::all_topics().begin(), dds::all_topics().end()),
                         [](const auto& test) { return std::string(test.param->name); });

TEST(LateJoiner, OfAnotherVendorGetsWhatADurableTopicHolds) {
  const core::NetworkOptions here = network(0), there = network(1);
  dds::Participant sender("sender", here), receiver("receiver", there);
  dds::Writer<msg::WorkspaceBrick> writer(sender, dds::kWorkspaceBrick);
  msg::WorkspaceBrick brick;
  constexpr int kBricks = 100;
  for (int x = 0; x < kBricks; ++x) {
    brick.bx(x);
    brick.voxels_zstd(std::vector<std::uint8_t>(3000, static_cast<std::uint8_t>(x)));
    ASSERT_TRUE(writer.write(brick));
  }
  CycloneMirror late(dds::kWorkspaceBrick, here.domain, there.domain);
  EXPECT_TRUE(dds::eventually([&] { return late.mirrored() == kBricks; }))
      << late.mirrored() << " of " << kBricks;
  // And our own late joiner gets them from the other vendor.
  dds::Waiter waiter;
  std::size_t count = 0;
  dds::Reader<msg::WorkspaceBrick> reader(
      receiver, dds::kWorkspaceBrick, [&](const msg::WorkspaceBrick& sample, const dds::SampleInfo&) {
        EXPECT_EQ(sample.voxels_zstd(),
                  std::vector<std::uint8_t>(3000, static_cast<std::uint8_t>(sample.bx())));
        waiter.change([&] { ++count; });
      });
  EXPECT_TRUE(waiter.wait([&] { return count == kBricks; }));
}

}  // namespace
}  // namespace phantom::interop

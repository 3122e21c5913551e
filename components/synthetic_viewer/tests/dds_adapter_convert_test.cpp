#include <gtest/gtest.h>

#include "components/synthetic_viewer/dds_adapter_intake.hpp"
#include "components/synthetic_viewer/dds_adapter_names.hpp"
#include "components/synthetic_viewer/state.hpp"

namespace phantom::synthetic_viewer {
namespace {

TEST(Conversion, SkinPercept) {
  messages::SkinPercept percept;
  percept.valid = true;
  percept.patch_m = 0.02;
  percept.greatest_mu_Pa_s_per_m = 32;
  percept.felt = {{7, {}, 8}, {0, {}, 100}};  // the object's skin: closer than the closest layer
  const SkinSample sample = skin_of(percept, 5);
  EXPECT_TRUE(sample.valid);
  ASSERT_EQ(sample.felt.size(), 2U);
  EXPECT_EQ(sample.felt[0].link, 7U);
  EXPECT_EQ(sample.felt[0].closeness, 0.25F);
  EXPECT_EQ(sample.felt[1].closeness, 1.0F);
  percept.valid = false;
  EXPECT_FALSE(skin_of(percept, 5).valid);
  EXPECT_TRUE(skin_of(percept, 5).felt.empty());
}

// Tries synthetic_viewer: component_status under more than 256
TEST(ComponentNames, ANewNameWaitsUntilAnotherHasBeenSilentForTenSeconds) {
  constexpr core::Nanoseconds kStart_ns = core::kNsPerSecond;
  ComponentNames names(ViewerState::kMaxComponents);
  std::uint64_t number = 0;
  const auto heard = [&](int name, core::Nanoseconds at_ns) {
    msg::Stamp stamp;
    stamp.session(static_cast<std::uint64_t>(name) + 1);
    stamp.sequence_number(++number);
    stamp.monotonic_ns(at_ns);
    return names.accept("slave_io@host_" + std::to_string(name), stamp, at_ns);
  };
  constexpr int kKnown = 256;
  for (int name = 0; name < kKnown; ++name) EXPECT_TRUE(heard(name, kStart_ns));
  for (int name = 1; name < kKnown; ++name)
    EXPECT_TRUE(heard(name, kStart_ns + 6 * core::kNsPerSecond)) << "all but the first go on";
  EXPECT_FALSE(heard(kKnown, kStart_ns + 6 * core::kNsPerSecond));
  EXPECT_FALSE(heard(kKnown, kStart_ns + 10 * core::kNsPerSecond - 1));
  EXPECT_TRUE(heard(kKnown, kStart_ns + 10 * core::kNsPerSecond)) << "in place of the first";
  EXPECT_TRUE(heard(kKnown, kStart_ns + 11 * core::kNsPerSecond));
  EXPECT_FALSE(heard(0, kStart_ns + 11 * core::kNsPerSecond)) << "which is a new name now";
  EXPECT_TRUE(heard(1, kStart_ns + 11 * core::kNsPerSecond));
}

}  // namespace
}  // namespace phantom::synthetic_viewer

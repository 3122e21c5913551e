#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "components/synthetic_viewer/state/state.hpp"
#include "components/synthetic_viewer/topics/dds_adapter_intake.hpp"
#include "components/synthetic_viewer/topics/dds_adapter_names.hpp"

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

class PicturesOfATopic : public ::testing::Test {
 protected:
  /// The newest picture of the camera called gate, exposed `age_s` before it came.
  msg::CameraPicture picture(double age_s) {
    msg::CameraPicture message;
    message.stamp().session(7);
    message.stamp().sequence_number(++number_);
    message.stamp().monotonic_ns(static_cast<std::int64_t>(number_));
    message.camera("gate");
    message.exposed_utc_ns(static_cast<std::uint64_t>(kUtc_ns - core::from_seconds(age_s)));
    message.width(64), message.height(48), message.jpeg({0xff, 0xd8, 1});
    return message;
  }
  auto take(const msg::CameraPicture& message) {
    return intake_.take(message, "gate", kAt_ns, kUtc_ns, board_);
  }

  static constexpr core::Nanoseconds kAt_ns = 50 * core::kNsPerSecond, kUtc_ns = 1'800'000'000'000'000'000;
  std::uint64_t number_ = 0;
  SampleFilter intake_{messages::ArmBounds{}};
  StopStatus board_;
};

TEST_F(PicturesOfATopic, HaveTheTimeOfTheirExposureByThisHostsClock) {
  const auto taken = take(picture(0.25));
  ASSERT_TRUE(taken) << taken.status().message();
  ASSERT_TRUE(taken->has_value());
  EXPECT_EQ((*taken)->jpeg.size(), 3U);
  EXPECT_EQ((*taken)->arrived_ns, kAt_ns);
  EXPECT_EQ((*taken)->exposed_ns, kAt_ns - core::from_seconds(0.25));
  EXPECT_EQ((**take(picture(-0.05))).exposed_ns, kAt_ns) << "clocks in step still differ a little";
  msg::CameraPicture unstamped = picture(0.0);
  unstamped.exposed_utc_ns(0);
  EXPECT_FALSE((**take(unstamped)).exposed_ns.has_value());
}

// Tries synthetic_viewer: a camera_picture that is not valid
TEST_F(PicturesOfATopic, WhatIsOldOfAnotherClockRepeatedOrForeignIsNotTaken) {
  EXPECT_THAT(take(picture(5.1)).status().message(),
              ::testing::HasSubstr("exposed 5.1 s ago; allowed: at most 5 s ago"));
  EXPECT_THAT(take(picture(-7.0)).status().message(), ::testing::HasSubstr("exposed 7.0 s ahead"));
  const msg::CameraPicture once = picture(0.1);
  EXPECT_TRUE(take(once));
  EXPECT_THAT(take(once).status().message(), ::testing::HasSubstr("not newer than the last"));
  msg::CameraPicture none = picture(0.1);
  none.jpeg().clear();
  EXPECT_EQ(take(none).status().message(), "a camera_picture: jpeg has 0 octets; allowed: 1 to 4194304");
  msg::CameraPicture other = picture(0.1);
  other.camera("door");
  const auto foreign = take(other);
  ASSERT_TRUE(foreign);
  EXPECT_FALSE(foreign->has_value());
  EXPECT_TRUE(take(picture(0.1))) << "and none of that was remembered";
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

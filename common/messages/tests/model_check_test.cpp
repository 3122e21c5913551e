#include "common/messages/model_check.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/support/captured_log.hpp"

namespace phantom::messages::model_check_test {
namespace {

constexpr core::Nanoseconds kMs = core::kNsPerMillisecond, kS = core::kNsPerSecond;

// Tries phantom_sensing: slave state of another arm or cell
TEST(ModelCheck, SR21_SaysHowTheNewestWritersModelDiffersAndForgetsItsPredecessors) {
  robot::ModelIdentity own;
  own.joints = {1, 2};
  own.joint_names = {"shoulder", "elbow"};
  own.joint_texts = {"this", "that"};
  robot::ModelIdentity other = own;
  other.joints[1] = 3;
  ModelCheck check("slave_state", std::make_shared<const robot::ModelIdentity>(own));
  EXPECT_FALSE(check.differs());
  check.look(label_of(other), kS);
  EXPECT_TRUE(check.differs());
  EXPECT_THAT(check.difference(), testing::HasSubstr("another joint elbow"));
  check.look(label_of(own), kS + kMs);
  EXPECT_FALSE(check.differs());
  EXPECT_NE(check.difference(), "") << "the other may be there";
  check.look(label_of(own), kS + ModelCheck::kReported_ns);
  EXPECT_EQ(check.difference(), "");
  check.look(label_of(other), 9 * kS);
  check.look("", 9 * kS);
  EXPECT_FALSE(check.differs()) << "a writer that does not say";
}

// Two masters of which one has another arm, each with a thousand samples a second.
TEST(ModelCheck, WritersThatAlternateAreLoggedOnce) {
  robot::ModelIdentity own;
  own.joints = {1, 2};
  own.joint_names = own.joint_texts = {"shoulder", "elbow"};
  robot::ModelIdentity other = own;
  other.joints[1] = 3;
  ModelCheck check("master_state", std::make_shared<const robot::ModelIdentity>(own));
  const test::CapturedLog log;
  for (int ms = 1000; ms < 9000; ++ms) {
    check.look(label_of(ms % 2 == 0 ? own : other), ms * kMs);
    EXPECT_EQ(check.differs(), ms % 2 != 0);
    EXPECT_EQ(check.difference().empty(), ms == 1000) << "reported while that one is there";
  }
  const std::string text = log.text();
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 1) << text;
}

TEST(ModelCheck, WithoutAModelOfItsOwnNothingDiffers) {
  ModelCheck check("slave_state", nullptr);
  check.look("phantom_model=1;joints=1,2", kS);
  EXPECT_FALSE(check.differs());
}

}  // namespace
}  // namespace phantom::messages::model_check_test

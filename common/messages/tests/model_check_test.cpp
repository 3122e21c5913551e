#include "common/messages/model_check.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace phantom::messages {
namespace {

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
  check.look(label_of(other));
  EXPECT_TRUE(check.differs());
  EXPECT_THAT(check.difference(), testing::HasSubstr("another joint elbow"));
  check.look(label_of(own));
  EXPECT_FALSE(check.differs());
  EXPECT_EQ(check.difference(), "");
  check.look(label_of(other));
  check.look("");
  EXPECT_FALSE(check.differs()) << "a writer that does not say";
}

TEST(ModelCheck, WithoutAModelOfItsOwnNothingDiffers) {
  ModelCheck check("slave_state", nullptr);
  check.look("phantom_model=1;joints=1,2");
  EXPECT_FALSE(check.differs());
}

}  // namespace
}  // namespace phantom::messages

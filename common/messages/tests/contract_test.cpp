// Every topic's codec against what the IDL says of its fields.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "common/messages/codecs/haptic_device_codec.hpp"
#include "common/messages/codecs/percept_codec.hpp"
#include "common/messages/codecs/status_codec.hpp"
#include "common/messages/codecs/teleoperation_codec.hpp"
#include "common/messages/codecs/workspace_codec.hpp"
#include "tests/support/topic_samples.hpp"

namespace phantom::messages::contract {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN(),
                 kInfinite = std::numeric_limits<double>::infinity();

template <class T>
T number_as(double value) {
  return static_cast<T>(value);
}
template <class T>
T below(double bound) {
  return std::nextafter(static_cast<T>(bound), std::numeric_limits<T>::lowest());
}
template <class T>
T above(double bound) {
  return std::nextafter(static_cast<T>(bound), std::numeric_limits<T>::max());
}

/// How a message is spoiled, and the field that the refusal must name.
template <class Message>
struct Fault {
  const char* field;
  void (*spoil)(Message&);
};

template <class Message>
struct Of;

#include "phantom_contract/topic_faults.inc"

template <class Message>
class Contract : public testing::Test {
 protected:
  Contract() {
    test::with_sample(Of<Message>::topic(),
                      [&](void* sample) { good = *static_cast<const Message*>(sample); });
  }
  Message good;
};
TYPED_TEST_SUITE(Contract, Messages);

TYPED_TEST(Contract, ASampleWithinItsRangesComesBackTheSame) {
  const auto sample = from_idl(this->good);
  ASSERT_TRUE(sample) << sample.status().message();
  TypeParam back = to_idl(*sample);
  if constexpr (requires { back.stamp(); }) back.stamp(this->good.stamp());  // the writer completes it
  EXPECT_EQ(back, this->good);
}

TYPED_TEST(Contract, SR11_AFieldBeyondItsRangeIsRefusedByItsName) {
  const auto faults = Of<TypeParam>::faults();
  ASSERT_FALSE(faults.empty());
  for (const auto& [field, spoil] : faults) {
    TypeParam message = this->good;
    if constexpr (std::is_same_v<TypeParam, msg::WorkspaceCommand>) {
      // Each pose counts for its own operation.
      if (std::string(field) == "X_FO") message.operation(msg::WorkspaceOperation::WORKSPACE_ATTACH);
      message.X_FO(this->good.X_WO());
    }
    spoil(message);
    const auto sample = from_idl(message);
    ASSERT_FALSE(sample) << field;
    EXPECT_THAT(sample.status().message(), testing::HasSubstr(field));
  }
}

}  // namespace
}  // namespace phantom::messages::contract

#include "common/teleop/bilateral.hpp"

#include <gtest/gtest.h>

namespace phantom::teleop {
namespace {

core::JointArray joints(double a, double b, double c) {
  core::JointArray values{};
  values[0] = a, values[1] = b, values[2] = c;
  return values;
}

TEST(Bilateral, PositionForwardFeelsNothingOfTheSlave) {
  EXPECT_EQ(feedback_torque(BilateralLaw::kPf, {joints(5, -3, 1)}, 0.5, 3), core::JointArray{});
}

TEST(Bilateral, SlaveTorqueComesBackReversedAndDividedByA) {
  const auto torque_Nm = feedback_torque(BilateralLaw::kSctfb, {joints(5, -3, 1)}, 0.5, 2);
  EXPECT_EQ(torque_Nm, joints(-2.5, 1.5, 0));  // the third joint does not exist
}

TEST(Bilateral, LawsOfALaterVersionRenderNothing) {
  for (const auto law : {BilateralLaw::kPfff, BilateralLaw::kPe, BilateralLaw::kPeff}) {
    EXPECT_FALSE(is_supported(law));
    EXPECT_EQ(feedback_torque(law, {joints(5, -3, 1)}, 1.0, 3), core::JointArray{});
  }
}

TEST(Bilateral, NamesRoundTrip) {
  for (const auto law : {BilateralLaw::kPf, BilateralLaw::kSctfb, BilateralLaw::kPfff, BilateralLaw::kPe,
                         BilateralLaw::kPeff}) {
    EXPECT_EQ(law_from_name(name_of(law)), law);
  }
  EXPECT_FALSE(law_from_name("case_b").has_value());
}

TEST(Bilateral, MasterTorqueIsTheSumWithinTheDevicesLimit) {
  const auto torque_Nm = master_torque(joints(1, -2, 2), joints(0.5, -2, -3), joints(2, 3, 2), 3);
  EXPECT_EQ(torque_Nm, joints(1.5, -3, -1));
}

}  // namespace
}  // namespace phantom::teleop

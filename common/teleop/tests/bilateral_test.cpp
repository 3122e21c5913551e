#include "common/teleop/coupling/bilateral.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace phantom::teleop {
namespace {

core::JointArray joints(double a, double b, double c) {
  core::JointArray values{};
  values[0] = a, values[1] = b, values[2] = c;
  return values;
}

JointMotion motion(double scale) { return {joints(scale, -2 * scale, 3), joints(0.1 * scale, 0.2, -scale)}; }

// Table 5.1, line by line.
TEST(Bilateral, EveryLawIsItsLineOfTheTable) {
  const JointMotion master = motion(1.5), slave = motion(1.2);
  const SlaveEffort effort{joints(5, -3, 1), joints(-4, 2, 0.5)};
  const ExchangeGains gains{joints(20, 30, 40), joints(2, 3, 4)};
  const double inverse_a = 0.3;
  for (const auto law : {BilateralLaw::kPf, BilateralLaw::kSctfb, BilateralLaw::kPfff, BilateralLaw::kPe,
                         BilateralLaw::kPeff}) {
    const auto torque_Nm =
        feedback_torque(law, master, slave, effort, gains, joints(inverse_a, inverse_a, 0), 2);
    for (std::size_t j = 0; j < 2; ++j) {
      const double exchange = gains.k_p[j] * (master.position[j] - slave.position[j]) +
                              gains.k_v[j] * (master.velocity[j] - slave.velocity[j]);
      const double f_as = effort.loop_torque_Nm[j],
                   f_e = -effort.external_torque_Nm[j];  // what the arm exerts
      double f_am = 0.0;
      if (law == BilateralLaw::kSctfb) f_am = f_as;
      if (law == BilateralLaw::kPfff) f_am = f_e;
      if (law == BilateralLaw::kPe) f_am = exchange;
      if (law == BilateralLaw::kPeff) f_am = exchange + f_e;
      EXPECT_NEAR(torque_Nm[j], -inverse_a * f_am, 1e-12) << name_of(law);
    }
    EXPECT_EQ(torque_Nm[2], 0.0);  // the third joint does not exist
  }
}

TEST(Bilateral, TheForceShareScalesTheForceOfLawEAlone) {
  const JointMotion master = motion(1.5), slave = motion(1.2);
  const SlaveEffort effort{joints(5, -3, 1), joints(-4, 2, 0.5)};
  ExchangeGains gains{joints(20, 30, 40), joints(2, 3, 4)};
  const auto torque_of = [&](BilateralLaw law, double share) {
    gains.force_share = share;
    return feedback_torque(law, master, slave, effort, gains, joints(0.3, 0.3, 0), 2);
  };
  for (std::size_t j = 0; j < 2; ++j) {
    EXPECT_NEAR(torque_of(BilateralLaw::kPeff, 0.1)[j] - torque_of(BilateralLaw::kPe, 0.1)[j],
                0.3 * 0.1 * effort.external_torque_Nm[j], 1e-12);
    EXPECT_EQ(torque_of(BilateralLaw::kPfff, 0.1)[j], torque_of(BilateralLaw::kPfff, 1.0)[j]);
  }
}

TEST(Bilateral, LawsCAndENeedAForceSensor) {
  EXPECT_TRUE(needs_force_sensor(BilateralLaw::kPfff));
  EXPECT_TRUE(needs_force_sensor(BilateralLaw::kPeff));
  EXPECT_FALSE(needs_force_sensor(BilateralLaw::kSctfb));
}

TEST(Bilateral, NamesRoundTrip) {
  for (const auto law : {BilateralLaw::kPf, BilateralLaw::kSctfb, BilateralLaw::kPfff, BilateralLaw::kPe,
                         BilateralLaw::kPeff}) {
    EXPECT_EQ(law_from_name(name_of(law)), law);
  }
  EXPECT_FALSE(law_from_name("case_b").has_value());
}

}  // namespace
}  // namespace phantom::teleop

#include "components/slave_io/config.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "common/core/errors.hpp"
#include "components/slave_io/tests/fixture.hpp"

namespace phantom::slave_io {
namespace {

using testing::AllOf;
using testing::HasSubstr;

std::string problem(const std::string& from, const std::string& to) { return problem_of_changed(from, to); }

TEST(SlaveConfig, TheShippedFileIsValid) {
  const auto config = shipped_config();
  EXPECT_DOUBLE_EQ(config.period_s, 0.001);
  for (std::size_t j = 0; j < shipped_arm().arm.joint_count(); ++j) {
    const auto& joint = shipped_arm().arm.joints()[j];
    EXPECT_GT(config.plant.joints[j].inertia, 0.0);
    EXPECT_LE(config.gains[j].torque_limit, joint.max_effort);
    EXPECT_EQ(config.plant.joints[j].upper, joint.upper);
  }
}

TEST(SlaveConfig, SingleJointsMayHaveTheirOwnGains) {
  const auto file = changed("gravity_feed_forward: false",
                            "gravity_feed_forward: false\n  joints: {j7_tool_roll: {k_p: 120, k_v: 8}}");
  const auto config = load_config(file, shipped_arm().arm, shipped_arm().home);
  EXPECT_EQ(config.gains[6].k_p, 120);
  EXPECT_EQ(config.gains[6].k_v, 8);
  EXPECT_EQ(config.gains[5].k_p, shipped_config().gains[5].k_p);
}

TEST(SlaveConfig, EachFaultIsNamedWithWhatIsAllowed) {
  EXPECT_THAT(problem("driver: sim", "driver: magic"),
              AllOf(HasSubstr("driver"), HasSubstr("allowed: sim, can")));
  EXPECT_THAT(problem("rate_Hz: 1000", "rate_Hz: fast"),
              AllOf(HasSubstr("rate_Hz"), HasSubstr("50 to 5000 Hz")));
  EXPECT_THAT(problem("rate_Hz: 1000", "rate_Hz: 1"), AllOf(HasSubstr("rate_Hz"), HasSubstr("out of range")));
  EXPECT_THAT(problem("  bandwidth_Hz: 8", "  bandwidth_hz: 8"),
              AllOf(HasSubstr("servo.bandwidth_Hz"), HasSubstr("missing")));
  EXPECT_THAT(problem("  sub_steps: 4", "  sub_step: 4"),
              AllOf(HasSubstr("sub_step"), HasSubstr("did you mean sub_steps")));
  EXPECT_THAT(problem("  staleness_s: 0.06", "  staleness_s: .nan"),
              AllOf(HasSubstr("link.staleness_s"), HasSubstr("allowed")));
  EXPECT_THAT(problem("  stiffness_N_per_m: 30000", "  stiffness_N_per_m: -1"),
              HasSubstr("contact.stiffness_N_per_m"));
  EXPECT_THAT(problem("  friction: 0.2", "  friction: -0.2"),
              AllOf(HasSubstr("contact.friction"), HasSubstr("0 to 2")));
  EXPECT_THAT(
      problem("gravity_feed_forward: false", "gravity_feed_forward: false\n  joints: {j9: {k_p: 1, k_v: 1}}"),
      AllOf(HasSubstr("servo.joints.j9"), HasSubstr("unknown"), HasSubstr("j7_tool_roll")));
  EXPECT_THAT(problem("gravity_feed_forward: false", "gravity_feed_forward: maybe"),
              HasSubstr("true or false"));
}

}  // namespace
}  // namespace phantom::slave_io

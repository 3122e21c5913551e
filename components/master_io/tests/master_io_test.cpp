#include "components/master_io/master_io.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "components/master_io/session.hpp"
#include "components/master_io/tests/fixture.hpp"

namespace phantom::master_io {
namespace {

using teleop::LinkState;
constexpr double kDt = 0.001;
constexpr std::size_t kJoints = 7;

MasterInputs coupled_inputs() {
  MasterInputs in;
  in.position = in.slave.position = shipped_arm().home;
  in.slave.state = LinkState::kCoupled;
  in.partner_age_s = in.drag_age_s = 0.001;
  in.drag.drag.valid = true;
  in.drag.drag.plus.fill(0.1);
  in.drag.drag.minus.fill(0.1);
  in.settings.percept_gain = teleop::everywhere(10);
  in.settings.feedback_gain = teleop::everywhere(0.01);
  return in;
}

MasterReport run(MasterIo& master, const MasterInputs& in, double duration_s) {
  MasterReport out;
  for (double t = 0; t < duration_s; t += kDt) master.step(in, kDt, out);
  return out;
}

TEST(MasterIo, SR06_NoTorqueBeforeCoupling) {
  MasterIo master(shipped_config(), teleop::StopLatch(1, {}));
  MasterInputs in = coupled_inputs();
  in.slave.state = LinkState::kReady;
  in.slave.loop_torque_Nm.fill(40);
  in.velocity.fill(0.5);
  const auto out = run(master, in, 2.0);
  EXPECT_EQ(out.state, LinkState::kAligned);
  EXPECT_EQ(out.outputs.motor_Nm, core::JointArray{});
}

TEST(MasterIo, TheStepFillsTheMessageFieldByField) {
  const Config config = shipped_config();
  MasterIo master(config, teleop::StopLatch(1, {}));
  MasterInputs in = coupled_inputs();
  in.velocity[3] = 0.4;
  in.slave.loop_torque_Nm[1] = 100;
  in.settings.percept_gain = teleop::everywhere(1000);  // more than is stable
  MasterReport report = run(master, in, 2.0);
  EXPECT_EQ(report.state, LinkState::kCoupled);
  EXPECT_EQ(report.law, teleop::BilateralLaw::kSctfb);
  EXPECT_LT(report.percept_torque_Nm[3], 0);
  EXPECT_LT(report.feedback_torque_Nm[1], 0);
  EXPECT_LT(report.percept_gain, 1000);
  EXPECT_TRUE(report.percept_limited);
  EXPECT_EQ(report.feedback_gain, 0.01);
  EXPECT_TRUE(report.percept_enabled && report.drag_chosen && report.tone_enabled && report.views_enabled);
  EXPECT_FALSE(report.percept_set_automatic || report.force_missing || report.switch_fitted);
  EXPECT_TRUE(report.motion_permitted);

  in.settings.law = teleop::BilateralLaw::kPfff;
  in.settings.percepts = {false, false, false, true};
  in.settings.percept_gain = teleop::everywhere(1);
  in.stop_requests = 1;
  in.enabling = teleop::SwitchState::kReleased;
  for (int i = 0; i < 2000; ++i) master.step(in, kDt, report);  // into the same message
  EXPECT_EQ(report.state, LinkState::kStopped);
  EXPECT_EQ(report.stop.cause, teleop::StopCause::kEmergency);
  EXPECT_NE(report.stop.id, 0U);
  EXPECT_EQ(report.stop, report.outputs.stop);
  EXPECT_EQ(report.law, teleop::BilateralLaw::kPfff);
  EXPECT_TRUE(report.force_missing);
  EXPECT_FALSE(report.percept_enabled || report.drag_chosen || report.tone_enabled || report.views_enabled);
  EXPECT_TRUE(report.percept_set_automatic);
  EXPECT_FALSE(report.percept_limited);
  EXPECT_TRUE(report.switch_fitted);
  EXPECT_FALSE(report.motion_permitted);
  EXPECT_EQ(report.percept_torque_Nm, core::JointArray{});
  EXPECT_EQ(report.feedback_torque_Nm, core::JointArray{});
}

// A drag of 0.12 N·m stands apart from a weight that is felt as 0.5 N·m, and not from one of 3 N·m.
// Tries master_io: the slave's weight or lag masks the drag
TEST(MasterIo, AWeightThatMasksTheDragIsReportedWithItsRemedy) {
  MasterInputs in = coupled_inputs();
  in.velocity[3] = 0.12;
  in.drag.drag.plus.fill(0.1);
  in.slave.loop_torque_Nm[3] = 250;
  in.slave.counterbalance = teleop::Counterbalance::kNone;
  const Config config = shipped_config();
  const auto felt = [&](double inverse_a, teleop::BilateralLaw law = teleop::BilateralLaw::kSctfb) {
    MasterIo master(config, teleop::StopLatch(1, {}));
    in.settings.law = law;
    in.settings.feedback_gain = teleop::everywhere(inverse_a);
    return run(master, in, 4.0);
  };
  EXPECT_FALSE(felt(0.002).outputs.drag_masked);
  EXPECT_EQ(sentence(felt(0.002)), "");
  const MasterReport heavy = felt(0.012);
  ASSERT_TRUE(heavy.outputs.drag_masked)
      << heavy.percept_torque_Nm[3] << " beside " << heavy.feedback_torque_Nm[3] << " N·m";
  EXPECT_THAT(sentence(heavy), testing::StartsWith("the arm's weight masks the drag"));
  in.slave.contact = true;
  EXPECT_FALSE(felt(0.012).outputs.drag_masked) << "a contact shall be felt";
  in.slave.contact = false;
  in.settings.percepts.drag = false;
  EXPECT_FALSE(felt(0.012).outputs.drag_masked) << "nothing to mask";
  in.settings.percepts.drag = true;
  in.slave.counterbalance = teleop::Counterbalance::kMechanical;
  EXPECT_THAT(sentence(felt(0.012)), testing::StartsWith("the slave's feedback masks the drag"));
  in.settings.law = teleop::BilateralLaw::kPe;
  in.settings.feedback_gain = teleop::everywhere(1.0);
  MasterIo exchange(config, teleop::StopLatch(1, {}));
  run(exchange, in, 1.0);
  in.slave.position[3] -= 0.3;  // it lags behind
  EXPECT_THAT(sentence(run(exchange, in, 4.0)), testing::StartsWith("the slave's lag masks the drag"));
}

// A torque at its cap is no guard of stability.
TEST(MasterIo, ACapAndAGuardOfStabilityAreToldApart) {
  Config config = shipped_config();
  MasterIo master(config, teleop::StopLatch(1, {}));
  MasterInputs in = coupled_inputs();
  in.velocity[3] = 0.01;
  in.settings.percept_gain = teleop::everywhere(1000);
  MasterReport report = run(master, in, 2.0);
  EXPECT_TRUE(report.percept_limited) << "more than is stable";
  EXPECT_TRUE(report.outputs.damping_limited);
  EXPECT_FALSE(report.outputs.percept_capped || report.outputs.feedback_capped);

  config.percept.torque_cap_Nm[3] = 0.01;
  MasterIo weak(config, teleop::StopLatch(1, {}));
  in.settings.percept_gain = teleop::everywhere(1);
  in.velocity[3] = 0.4;
  report = run(weak, in, 2.0);
  EXPECT_FALSE(report.outputs.damping_limited || report.outputs.feedback_capped);
  EXPECT_TRUE(report.percept_limited && report.outputs.percept_capped);
  EXPECT_EQ(report.percept_torque_Nm[3], -0.01);

  in.velocity = {};
  in.drag.reaction.torque[3] = -1e6;
  in.drag.reaction.position = in.position;
  report = run(weak, in, 2.0);
  EXPECT_FALSE(report.percept_limited || report.outputs.percept_capped);
  EXPECT_TRUE(report.outputs.feedback_capped);
}

TEST(MasterIo, RendersTheSumOfPerceptAndSlaveTorque) {
  MasterIo master(shipped_config(), teleop::StopLatch(1, {}));
  MasterInputs in = coupled_inputs();
  in.velocity[3] = 0.4;
  in.slave.loop_torque_Nm[3] = 100;
  const auto out = run(master, in, 2.0);
  EXPECT_EQ(out.state, LinkState::kCoupled);
  EXPECT_NEAR(out.percept_torque_Nm[3], -10 * 0.1 * 0.4, 1e-6);
  EXPECT_NEAR(out.feedback_torque_Nm[3], -0.01 * 100, 1e-6);
  EXPECT_NEAR(out.outputs.motor_Nm[3], out.percept_torque_Nm[3] + out.feedback_torque_Nm[3], 1e-12);
  EXPECT_EQ(out.percept_gain, 10);
}

// What soft bodies answer is felt at rest, in any law, at the master's own position, and ends with the drag
// field.
TEST(MasterIo, SoftBodiesPushBackUntilTheyAreStale) {
  const auto config = shipped_config({"", "pf"});
  MasterIo master(config, teleop::StopLatch(1, {}));
  MasterInputs in = coupled_inputs();
  in.settings.law = teleop::BilateralLaw::kPf;
  in.drag.reaction.torque[3] = -0.5;
  in.drag.reaction.stiffness[3] = 2.0;
  in.drag.reaction.position = in.position;
  EXPECT_NEAR(run(master, in, 2.0).feedback_torque_Nm[3], -0.5, 1e-6);
  in.position[3] += 0.05;
  EXPECT_NEAR(run(master, in, 0.1).feedback_torque_Nm[3], -0.6, 1e-6);
  in.drag.reaction.torque[3] = -1e6;
  EXPECT_NEAR(run(master, in, 1.0).feedback_torque_Nm[3], -config.feedback.torque_cap_Nm[3], 1e-6);
  in.drag_age_s = 1.0;
  EXPECT_EQ(run(master, in, 0.5).feedback_torque_Nm, core::JointArray{});
}

TEST(MasterIo, PositionForwardRendersThePerceptAlone) {
  MasterIo master(shipped_config({"", "pf"}), teleop::StopLatch(1, {}));
  MasterInputs in = coupled_inputs();
  in.settings.law = teleop::BilateralLaw::kPf;
  in.velocity[3] = 0.4;
  in.slave.loop_torque_Nm[3] = 20;
  const auto out = run(master, in, 2.0);
  EXPECT_EQ(out.feedback_torque_Nm, core::JointArray{});
  EXPECT_LT(out.percept_torque_Nm[3], 0);
}

TEST(MasterIo, TheLawChangesWhileCoupledWithoutAJump) {
  MasterIo master(shipped_config(), teleop::StopLatch(1, {}));
  MasterInputs in = coupled_inputs();
  in.settings.feedback_gain = teleop::everywhere(teleop::kLawsOwnGain);
  in.slave.loop_torque_Nm[3] = 20;
  in.slave.external_torque_Nm[3] = -30;
  in.slave.force_measured = true;
  in.slave.position[3] -= 0.01;
  auto before = run(master, in, 2.0);
  EXPECT_EQ(before.law, teleop::BilateralLaw::kSctfb);
  for (const auto law :
       {teleop::BilateralLaw::kPfff, teleop::BilateralLaw::kPe, teleop::BilateralLaw::kPeff}) {
    in.settings.law = law;
    for (int i = 0; i < 1000; ++i) {
      const auto now = run(master, in, kDt);
      ASSERT_LT(std::abs(now.outputs.motor_Nm[3] - before.outputs.motor_Nm[3]), 0.1);
      before = now;
    }
    EXPECT_EQ(before.law, law);
    EXPECT_LT(before.feedback_torque_Nm[3], -0.05);
  }
}

TEST(MasterIo, ContactRaisesTheGainByWhoeverIsTrusted) {
  for (const auto source : {ContactSource::kSlave, ContactSource::kPhantom, ContactSource::kEither}) {
    Config config = shipped_config();
    config.feedback.contact_gain_ratio = 1.2;
    config.contact_source = source;
    for (const bool sensed : {true, false}) {
      MasterIo master(config, teleop::StopLatch(1, {}));
      MasterInputs in = coupled_inputs();
      in.slave.contact = sensed;
      in.phantom.contact = !sensed;
      in.phantom_age_s = 0.01;
      const bool believed = source == ContactSource::kEither || (source == ContactSource::kSlave) == sensed;
      EXPECT_NEAR(run(master, in, 2.0).feedback_gain, believed ? 0.012 : 0.01, 1e-9);
      in.phantom_age_s = 0.5;  // an old percept tells nothing
      EXPECT_NEAR(run(master, in, 1.0).feedback_gain, believed && sensed ? 0.012 : 0.01, 1e-9);
    }
  }
}

// Tries master_io: a law that needs a force sensor
TEST(MasterIo, ALawWithoutItsForceSensorIsSaidAndSilent) {
  MasterIo master(shipped_config({"", "pfff"}), teleop::StopLatch(1, {}));
  MasterInputs in = coupled_inputs();
  in.settings.law = teleop::BilateralLaw::kPfff;
  in.slave.external_torque_Nm[3] = -30;
  const auto out = run(master, in, 2.0);
  EXPECT_TRUE(out.force_missing);
  EXPECT_EQ(out.feedback_torque_Nm, core::JointArray{});
}

// Whatever goes stale, torques fade out in bounded time and without a jump.
// Tries master_io: slave silent
// Tries master_io: phantom_sensing silent
TEST(MasterIo, SR07_StaleInputsFadeOutInBoundedTime) {
  const auto config = shipped_config();
  for (const bool slave_lost : {true, false}) {
    MasterIo master(config, teleop::StopLatch(1, {}));
    MasterInputs in = coupled_inputs();
    in.velocity.fill(0.5);
    in.slave.loop_torque_Nm.fill(150);
    auto before = run(master, in, 2.0);
    ASSERT_LT(before.percept_torque_Nm[2], -0.1);
    double gone_s = 0.0;
    for (double t = kDt; t < 0.5; t += kDt) {
      (slave_lost ? in.partner_age_s : in.drag_age_s) += kDt;
      const auto now = run(master, in, kDt);
      const double worst_ramp_s = std::min(config.percept.ramp_down_s, config.feedback.ramp_down_s);
      for (std::size_t j = 0; j < kJoints; ++j) {
        const double most = config.percept.torque_cap_Nm[j] + config.feedback.torque_cap_Nm[j];
        ASSERT_LE(std::abs(now.outputs.motor_Nm[j] - before.outputs.motor_Nm[j]),
                  1.1 * most * kDt / worst_ramp_s);
      }
      if (now.percept_torque_Nm != core::JointArray{}) gone_s = t;
      before = now;
    }
    EXPECT_EQ(before.percept_torque_Nm, core::JointArray{});
    EXPECT_LE(gone_s, config.percept_staleness_s + config.percept.ramp_down_s + 3 * kDt);
    EXPECT_EQ(before.state, slave_lost ? LinkState::kDegraded : LinkState::kCoupled);
    EXPECT_EQ(before.feedback_torque_Nm == core::JointArray{}, slave_lost);
  }
}

// A drag_field that comes regularly but goes back to a pose of long ago is none.
// Tries master_io: its drag of a pose of long ago
// Tries master_io: the slave answers another master_io
TEST(MasterIo, ASlaveThatAnswersAnotherIsNotCoupledWithAndThatIsSaid) {
  MasterIo master(shipped_config(), teleop::StopLatch(1, {}));
  MasterInputs in = coupled_inputs();
  in.velocity.fill(0.3);
  in.slave.echoes_other_session = true;
  auto out = run(master, in, 1.0);
  EXPECT_EQ(out.state, LinkState::kInit);
  EXPECT_EQ(sentence(out), "the slave answers another master_io: waiting");
  in.slave.echoes_other_session = false;
  out = run(master, in, 2.0);
  ASSERT_EQ(out.state, LinkState::kCoupled);
  ASSERT_NE(out.outputs.motor_Nm, core::JointArray{});
  in.slave.echoes_other_session = true;
  out = run(master, in, 0.5);
  EXPECT_EQ(out.state, LinkState::kDegraded);
  EXPECT_EQ(sentence(out), "the slave answers another master_io: torques off");
  EXPECT_EQ(teleop::component_state(out.outputs), core::ComponentState::kDegraded);
  EXPECT_EQ(out.outputs.motor_Nm, core::JointArray{});
}

TEST(MasterIo, SR14_DragOfLongAgoFadesOut) {
  const auto config = shipped_config();
  MasterIo master(config, teleop::StopLatch(1, {}));
  MasterInputs in = coupled_inputs();
  in.velocity.fill(0.5);
  in.drag_round_trip_s = 0.9 * config.link.round_trip_limit_s;
  ASSERT_LT(run(master, in, 2.0).percept_torque_Nm[2], -0.1);
  in.drag_round_trip_s = 1.1 * config.link.round_trip_limit_s;
  const auto out = run(master, in, config.percept.ramp_down_s + 3 * kDt);
  EXPECT_EQ(out.percept_torque_Nm, core::JointArray{});
  EXPECT_EQ(out.state, LinkState::kCoupled) << "the slave is heard all the time";
}

TEST(MasterIo, ADeviceThatDoesNotFollowIsNotCoupled) {
  MasterIo master(shipped_config(), teleop::StopLatch(1, {}));
  MasterInputs in = coupled_inputs();
  in.velocity.fill(0.5);
  in.drives_operational = false;
  EXPECT_EQ(run(master, in, 2.0).state, LinkState::kInit);
  in.drives_operational = true;
  ASSERT_EQ(run(master, in, 2.0).state, LinkState::kCoupled);
  in.drives_operational = false;
  const auto out = run(master, in, 0.5);
  EXPECT_EQ(out.state, LinkState::kDegraded);
  EXPECT_EQ(out.outputs.motor_Nm, core::JointArray{});
}

TEST(MasterIo, SR04_EmergencyStopTakesTheTorqueUntilReset) {
  MasterIo master(shipped_config(), teleop::StopLatch(1, {}));
  MasterInputs in = coupled_inputs();
  in.velocity.fill(0.5);
  in.slave.loop_torque_Nm.fill(150);
  run(master, in, 1.0);
  in.stop_requests = 1;
  int fading = 0;  // ticks in which torque fades out
  for (double t = 0; t < 0.3; t += kDt) {
    const auto now = run(master, in, kDt);
    if (now.outputs.motor_Nm == core::JointArray{}) continue;
    ++fading;
    ASSERT_TRUE(now.outputs.power) << "drives without power would take the torque away with a jerk";
  }
  EXPECT_GT(fading, 10);
  const auto stopped = run(master, in, kDt);
  EXPECT_EQ(stopped.state, LinkState::kStopped);
  EXPECT_EQ(stopped.outputs.motor_Nm, core::JointArray{});
  EXPECT_FALSE(stopped.outputs.power) << "nothing is felt any more: the drives need no power";
  EXPECT_EQ(run(master, in, 1.0).state, LinkState::kStopped);
  const teleop::StopReset reset{.own = stopped.stop.id};
  in.reset = &reset;
  EXPECT_EQ(run(master, in, 0.001).outputs.reset, teleop::ResetOutcome::kReleased);
  in.reset = nullptr;
  EXPECT_EQ(run(master, in, 1.0).state, LinkState::kCoupled);
}

TEST(MasterIo, NoCouplingAtADifferentPose) {
  MasterIo master(shipped_config(), teleop::StopLatch(1, {}));
  MasterInputs in = coupled_inputs();
  in.slave.position[5] += 0.1;
  EXPECT_EQ(run(master, in, 2.0).state, LinkState::kReady);
}

TEST(MasterIo, GainsFollowTheirSettingsSmoothly) {
  const auto config = shipped_config();
  MasterIo master(config, teleop::StopLatch(1, {}));
  MasterInputs in = coupled_inputs();
  in.slave.loop_torque_Nm[1] = 150;
  in.velocity[1] = 0.2;
  auto before = run(master, in, 2.0);
  in.settings.feedback_gain[1] = 0.02;
  in.settings.percept_gain[1] = 30;
  for (int i = 0; i < 1000; ++i) {
    const auto now = run(master, in, kDt);
    ASSERT_LE(std::abs(now.outputs.motor_Nm[1] - before.outputs.motor_Nm[1]),
              config.torque_rate_Nm_per_s[1] * kDt + 1e-9);
    before = now;
  }
  EXPECT_NEAR(before.feedback_torque_Nm[1], -3.0, 1e-6);
  EXPECT_NEAR(before.percept_torque_Nm[1], -30 * 0.1 * 0.2, 1e-6);
}

TEST(MasterIo, SR13_AGainBeyondTheDevicesStabilityIsHeldBackAndSaidSo) {
  const auto config = shipped_config();
  MasterIo master(config, teleop::StopLatch(1, {}));
  MasterInputs in = coupled_inputs();
  in.settings.percept_gain = teleop::everywhere(1000);
  in.velocity[1] = 1e-3;
  const auto out = run(master, in, 2.0);
  EXPECT_TRUE(out.outputs.damping_limited);
  EXPECT_LT(out.percept_gain, 1000);
  EXPECT_NEAR(out.percept_torque_Nm[1], -config.percept.damping_limit_Nms_per_rad[1] * 1e-3, 1e-9);
}

// 4.9 N came on the sliding joint within 0.7 ms: a slave's torque that steps is no kick any more.
TEST(MasterIo, SR10_NoTorqueOnTheHandChangesFasterThanConfigured) {
  const auto config = shipped_config();
  MasterIo master(config, teleop::StopLatch(1, {}));
  MasterInputs in = coupled_inputs();
  std::mt19937 random(4);
  std::uniform_real_distribution<double> any(-1, 1);
  auto before = run(master, in, 2.0);
  double greatest = 0.0;
  for (int i = 0; i < 20000; ++i) {
    if (i % 40 == 0) {
      for (std::size_t j = 0; j < kJoints; ++j) in.slave.loop_torque_Nm[j] = 5000 * any(random);
    }
    for (std::size_t j = 0; j < kJoints; ++j)
      in.velocity[j] = 0.3 * std::sin(0.01 * i + static_cast<double>(j));
    if (i % 900 == 0) in.slave.position[1] += 1e-4;
    const auto now = run(master, in, kDt);
    for (std::size_t j = 0; j < kJoints; ++j) {
      const double step = std::abs(now.outputs.motor_Nm[j] - before.outputs.motor_Nm[j]);
      ASSERT_LE(step, config.torque_rate_Nm_per_s[j] * kDt + 1e-9) << i << " joint " << j;
      ASSERT_LE(std::abs(now.feedback_torque_Nm[j]), config.feedback.torque_cap_Nm[j] + 1e-12);
      greatest = std::max(greatest, step / (config.torque_rate_Nm_per_s[j] * kDt));
    }
    before = now;
  }
  EXPECT_GT(greatest, 0.5) << "steps were tried";
}

// Property: the percept takes energy, whatever comes.
TEST(MasterIo, SR14_ThePerceptNeverDrivesTheHand) {
  const auto config = shipped_config();
  MasterIo master(config, teleop::StopLatch(1, {}));
  std::mt19937 random(9);
  std::uniform_real_distribution<double> any(-1, 1);
  MasterInputs in = coupled_inputs();
  run(master, in, 1.0);
  for (int i = 0; i < 20000; ++i) {
    for (std::size_t j = 0; j < kJoints; ++j) {
      in.velocity[j] = any(random);
      in.drag.drag.plus[j] = 5 * std::abs(any(random));
      in.drag.drag.minus[j] = 5 * std::abs(any(random));
    }
    in.percept_wanted = i % 500 != 0;
    in.drag_age_s = i % 700 < 50 ? 1.0 : 0.0;
    if (i % 13 == 0) in.drag.drag.plus[1] = std::nan("");
    const auto out = run(master, in, kDt);
    double power_W = 0.0;
    for (std::size_t j = 0; j < kJoints; ++j) {
      power_W += out.percept_torque_Nm[j] * in.velocity[j];
      ASSERT_LE(std::abs(out.percept_torque_Nm[j]), config.percept.torque_cap_Nm[j] + 1e-12);
      ASSERT_LE(std::abs(out.outputs.motor_Nm[j]), config.device.torque_limit_Nm[j]);
    }
    ASSERT_LE(power_W, 1e-12);
  }
}

}  // namespace
}  // namespace phantom::master_io

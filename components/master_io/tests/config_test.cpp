#include "components/master_io/config.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/core/errors.hpp"
#include "common/teleop/guards/stability_guard.hpp"
#include "components/master_io/reaches/reaches.hpp"
#include "components/master_io/tests/fixture.hpp"

namespace phantom::master_io {
namespace {

using testing::AllOf;
using testing::HasSubstr;

std::string problem_of(const std::filesystem::path& file, const Choices& choices = {}) {
  try {
    load_config(file, hot_cell().file, shipped_arm().arm, shipped_arm().home, choices);
  } catch (const core::ConfigError& error) {
    return error.what();
  }
  return "accepted";
}

std::string problem(const std::string& from, const std::string& to) {
  const auto file = changed(from, to);
  const std::string what = problem_of(file);
  EXPECT_THAT(what, HasSubstr(file.string()));
  return what;
}

std::string reaches_problem(const std::string& reaches) {
  const auto file = test::new_file(reaches);
  try {
    load_reaches(file, shipped_arm().arm);
  } catch (const core::ConfigError& error) {
    EXPECT_THAT(error.what(), HasSubstr(file.string() + ":"));
    return error.what();
  }
  return "accepted";
}

TEST(MasterConfig, TheShippedFileIsValidAndLeavesStabilityItsMargin) {
  const auto config = shipped_config();
  EXPECT_EQ(config.feedback.law, teleop::BilateralLaw::kSctfb);
  EXPECT_GE(config.script.reaches.size(), 4U);
  EXPECT_EQ(config.script.reaches.size(), config.labels.size());
  // One sample of command delay and two of the velocity filter.
  const double stable = teleop::damping_stability_limit(config.device.joints[1].inertia, config.period_s, 3);
  EXPECT_LE(config.percept.damping_limit_Nms_per_rad[1], 0.5 * stable + 1e-12);
  for (std::size_t j = 0; j < config.percept.joint_count; ++j) {
    EXPECT_LE(config.percept.torque_cap_Nm[j] + config.feedback.torque_cap_Nm[j],
              config.device.torque_limit_Nm[j])
        << "the sum must not be cut by the device";
  }
}

TEST(MasterConfig, AnEnablingSwitchIsNoKeyThatMeansSomethingElseAtTheDesk) {
  EXPECT_FALSE(shipped_config().enabling_switch.has_value()) << "none is fitted unless it is named";
  const auto with = [](const std::string& keys) {
    const std::string file = test::text_of(kShipped) + "\nenabling_switch: {source: input, " + keys + "}\n";
    return problem_of(test::new_file(file), {.driver = "desk"});
  };
  EXPECT_EQ(with("key: BTN_THUMBR, through_key: BTN_TR2"), "accepted");
  for (const char* taken : {"KEY_SPACE", "BTN_TR", "BTN_TL", "KEY_A", "0x13a"})
    EXPECT_THAT(with(std::string("key: ") + taken), HasSubstr("enabling_switch: has a key")) << taken;
  EXPECT_THAT(with("through_key: BTN_TL"), HasSubstr("enabling_switch: has a key"));
  EXPECT_EQ(with("key: KEY_A, device: My pedal"), "accepted") << "another device";
}

TEST(MasterConfig, TheCommandLineChoosesOperatorAndLaw) {
  const auto config = shipped_config({"constant_velocity", "pf"});
  EXPECT_EQ(config.hand.kind, simulation::OperatorKind::kConstantVelocity);
  EXPECT_EQ(config.feedback.law, teleop::BilateralLaw::kPf);
  const auto person = shipped_config().hand, cautious = shipped_config({"cautious", ""}).hand;
  EXPECT_EQ(cautious.stiffness, person.stiffness);
  EXPECT_LT(cautious.stop_share, person.stop_share);
  EXPECT_GT(cautious.reaction_delay_s, person.reaction_delay_s);
  const auto attentive = shipped_config({"attentive", ""}).hand;
  EXPECT_EQ(attentive.stop_share, cautious.stop_share);
  EXPECT_EQ(cautious.hearing.heed_from, 1.0) << "heeds no tone";
  EXPECT_LT(attentive.hearing.heed_from, attentive.hearing.creep_from);
  EXPECT_GT(attentive.sight.reaction_delay_s, attentive.hearing.reaction_delay_s);
  EXPECT_EQ(shipped_config({"", "peff"}).feedback.law, teleop::BilateralLaw::kPeff);
  EXPECT_THAT(problem_of(kShipped, {"", "pfx"}),
              AllOf(HasSubstr("'pfx'"), HasSubstr("allowed: pf (case a), sctfb (b)")));
  EXPECT_THAT(problem_of(kShipped, {"robot", ""}), AllOf(HasSubstr("'robot'"), HasSubstr("minimum_jerk")));
}

TEST(MasterConfig, EachFaultIsNamedWithWhatIsAllowed) {
  EXPECT_THAT(problem("driver: sim", "driver: magic"), AllOf(HasSubstr("driver"), HasSubstr("allowed: sim")));
  EXPECT_THAT(problem("    pe: 1 ", "    pe: 11 "),
              AllOf(HasSubstr("feedback.inverse_a.pe"), HasSubstr("0 to 10")));
  EXPECT_THAT(problem("    k_p_N_per_m: 150", "    k_p_N_per_m: -1"),
              HasSubstr("feedback.exchange.k_p_N_per_m"));
  EXPECT_THAT(problem("source: either", "source: nobody"),
              AllOf(HasSubstr("feedback.contact.source"), HasSubstr("slave, phantom, either")));
  EXPECT_THAT(problem("gain_ratio: 1 ", "gain_ratio: 0.5 "), HasSubstr("feedback.contact.gain_ratio"));
  EXPECT_THAT(problem("allowance_J: 0.05", "allowance_J: .nan"), HasSubstr("feedback.passivity.allowance_J"));
  EXPECT_THAT(problem("law: sctfb", "law: x"), AllOf(HasSubstr("law"), HasSubstr("allowed: pf, sctfb")));
  EXPECT_THAT(problem("rate_Hz: 1000", "rate_Hz: 0"),
              AllOf(HasSubstr("rate_Hz"), HasSubstr("50 to 5000 Hz")));
  EXPECT_THAT(problem("  gain: 20", "  gain: -1"), AllOf(HasSubstr("percept.gain"), HasSubstr("0 to 1000")));
  EXPECT_THAT(problem("  gain: 20", "  gian: 20"), HasSubstr("percept.gain"));
  EXPECT_THAT(problem("mode: separable", "mode: directional"),
              AllOf(HasSubstr("percept.mode"), HasSubstr("separable, coupled")));
  EXPECT_THAT(problem("  set: all", "  set: drag,smell"),
              AllOf(HasSubstr("percept.set"), HasSubstr("allowed: all, none, law")));
  EXPECT_THAT(problem("inertia_kg_m2: 0.05", "inertia_kg_m2: 0"), HasSubstr("device.revolute.inertia_kg_m2"));
  EXPECT_THAT(problem("mass_kg: 2", "mass_g: 2000"),
              AllOf(HasSubstr("device.prismatic.mass_kg"), HasSubstr("missing")));
  EXPECT_THAT(problem("sctfb: 0.01", "sctfb: .inf"), HasSubstr("feedback.inverse_a.sctfb"));
  EXPECT_THAT(
      problem("model: minimum_jerk", "model: toddler"),
      AllOf(HasSubstr("operator.model"), HasSubstr("minimum_jerk, cautious, attentive, constant_velocity")));
  EXPECT_THAT(problem("stop_share: 0.5", "stop_share: 0.04"),
              AllOf(HasSubstr("operator.cautious.stop_share"), HasSubstr("not above yield_share")));
  EXPECT_THAT(problem("creep_from: 0.7 ", "creep_from: 0.1 "),
              AllOf(HasSubstr("operator.attentive.hearing.creep_from"), HasSubstr("not above heed_from")));
  EXPECT_THAT(problem("centre_Hz: 10", "centre_Hz: 100"),
              HasSubstr("operator.minimum_jerk.tremor.centre_Hz"));
  EXPECT_THAT(problem("percept: alternate", "percept: sometimes"),
              AllOf(HasSubstr("sequence.percept"), HasSubstr("alternate, on, off")));
  EXPECT_THAT(problem("  patience: 3 ", "  patients: 3 "),
              AllOf(HasSubstr("patients"), HasSubstr("did you mean patience")));
  EXPECT_THAT(problem("only: []", "only: [to the moon]"),
              AllOf(HasSubstr("to the moon"), HasSubstr("gripper to")));
}

TEST(MasterConfig, AJointThatMayNotBeDampedDoesNotGoWithTheCoupledMatrix) {
  const auto undamped = changed("damping_cap_N_s_per_m: 400", "damping_cap_N_s_per_m: 0");
  EXPECT_EQ(problem_of(undamped), "accepted");
  EXPECT_THAT(problem_of(changed("mode: separable", "mode: coupled", undamped)),
              AllOf(HasSubstr("percept.mode"), HasSubstr("j1_gantry"), HasSubstr("allowed: separable")));
  EXPECT_EQ(problem_of(changed("mode: separable", "mode: coupled")), "accepted");
}

// Every law's: it may change while running.
// Tries master_io: a 1/A that is not stable at load
TEST(MasterConfig, GainsThatAreNotStableAreRefusedWithTheGreatestThatIs) {
  EXPECT_THAT(
      problem("    sctfb: 0.01", "    sctfb: 10"),
      AllOf(HasSubstr("feedback.inverse_a.sctfb"),
            HasSubstr(
                "1/A 10 is not stable on j3_shoulder with law sctfb and 4 ms delay; allowed: up to 0.01")));
  EXPECT_THAT(problem("    sctfb: 0.01", "    sctfb: 0.1"), HasSubstr("j3_shoulder"));
  EXPECT_THAT(problem("    pfff: 0.01", "    pfff: 0.1"), HasSubstr("feedback.inverse_a.pfff"));
  EXPECT_THAT(problem("    peff: 1", "    peff: 10"), HasSubstr("feedback.inverse_a.peff"));
  EXPECT_THAT(problem("k_p_N_m_per_rad: 8", "k_p_N_m_per_rad: 80"),
              AllOf(HasSubstr("feedback.inverse_a.pe"), HasSubstr("allowed: up to 0")));
  EXPECT_THAT(problem("gain_ratio: 1 ", "gain_ratio: 3 "), HasSubstr("j3_shoulder"));
  EXPECT_THAT(problem("expected_round_trip_s: 0.004", "expected_round_trip_s: 0.02"),
              HasSubstr("20 ms delay"));
  EXPECT_THAT(problem("    bandwidth_Hz: 8", "    bandwidth_Hz: 20"), HasSubstr("j3_shoulder"));
  EXPECT_THAT(problem("inertia_kg_m2: 0.05", "inertia_kg_m2: 0.01"), HasSubstr("not stable"));
  const auto none = changed("    sctfb: 0.01", "    sctfb: 0", changed("    pfff: 0.01", "    pfff: 0"));
  const auto off = changed("    pe: 1 ", "    pe: 0 ", changed("    peff: 1 ", "    peff: 0 ", none));
  EXPECT_EQ(problem_of(changed("rate_Hz: 1000 ", "rate_Hz: 60 ", off)), "accepted")
      << "no feedback is stable anywhere";
}

TEST(MasterConfig, EachJointMayHaveItsOwnDeviceGainsAndCaps) {
  auto file = changed(
      "percept:\n  mode",
      "  joints:\n    j7_tool_roll: {inertia: 0.1, torque_limit: 6, torque_rate: 100}\npercept:\n  mode");
  file = changed("  torque_cap_N_m: 2.2",
                 "  joints: {j7_tool_roll: {gain: 5, torque_cap: 1}}\n  torque_cap_N_m: 2.2", file);
  file = changed(
      "  torque_cap_N_m: 4",
      "  joints: {j7_tool_roll: {inverse_a: {sctfb: 0.05}, torque_cap: 2, k_p: 4}}\n  torque_cap_N_m: 4",
      file);
  ASSERT_EQ(problem_of(file), "accepted");
  const auto config = load_config(file, hot_cell().file, shipped_arm().arm, shipped_arm().home, {});
  const auto shipped = shipped_config();
  const auto law = static_cast<std::size_t>(teleop::BilateralLaw::kSctfb);
  EXPECT_EQ(config.device.joints[6].inertia, 0.1);
  EXPECT_EQ(config.feedback_loops[6].master_inertia, 0.1);
  EXPECT_EQ(config.device.torque_limit_Nm[6], 6);
  EXPECT_EQ(config.torque_rate_Nm_per_s[6], 100);
  EXPECT_EQ(config.percept_gain[6], 5);
  EXPECT_EQ(config.percept.torque_cap_Nm[6], 1);
  EXPECT_EQ(config.feedback.inverse_a[law][6], 0.05);
  EXPECT_EQ(config.feedback.torque_cap_Nm[6], 2);
  EXPECT_EQ(config.feedback.exchange.k_p[6], 4);
  EXPECT_EQ(config.device.joints[5].inertia, shipped.device.joints[5].inertia);
  EXPECT_EQ(config.percept_gain[5], shipped.percept_gain[5]);
  EXPECT_EQ(config.feedback.inverse_a[law][5], shipped.feedback.inverse_a[law][5]);
  EXPECT_THAT(problem("percept:\n  mode", "  joints: {j9: {inertia: 0.1}}\npercept:\n  mode"),
              HasSubstr("j9"));
  EXPECT_THAT(problem("  torque_cap_N_m: 2.2", "  joints: {j7_tool_roll: {gian: 5}}\n  torque_cap_N_m: 2.2"),
              HasSubstr("gian"));
  EXPECT_THAT(problem("  torque_cap_N_m: 4",
                      "  joints: {j3_shoulder: {inverse_a: {sctfb: 0.1}}}\n  torque_cap_N_m: 4"),
              AllOf(HasSubstr("j3_shoulder"), HasSubstr("not stable")));
}

TEST(MasterConfig, AMissingReachesFileIsNamed) {
  EXPECT_THAT([] { problem_of(changed("reaches_file: \"\"", "reaches_file: nowhere.yaml")); },
              ThrowsMessage<core::MissingError>(HasSubstr("nowhere.yaml")));
}

TEST(MasterConfig, ReachesMayBeChosenByName) {
  const auto all = load_reaches(hot_cell().file.parent_path() / "reaches.yaml", shipped_arm().arm);
  const auto sequence = runtime::Fields::from_text(
      "only: [" + all[2].label.name + ", " + all[0].label.name + "]", "x.yaml", {"only: []"});
  const auto chosen = choose_reaches(sequence, all);
  ASSERT_EQ(chosen.size(), 2U);
  EXPECT_EQ(chosen[0].reach.target, all[2].reach.target);
  EXPECT_EQ(chosen[1].label.object, all[0].label.object);
}

TEST(Reaches, EachFaultIsNamedWithWhatIsAllowed) {
  EXPECT_THAT(reaches_problem("reaches: []"), AllOf(HasSubstr("reaches"), HasSubstr("at least one")));
  EXPECT_THAT(reaches_problem("reaches: [{name: a, from: [0,0,0,0,0,0,0], target: [0,0,0]}]"),
              AllOf(HasSubstr("reaches[0].target"), HasSubstr("has 3 values; allowed: 7")));
  EXPECT_THAT(reaches_problem("reaches: [{name: a, from: [2,0,0,0,0,0,0], target: [0,0,0,0,0,0,0]}]"),
              AllOf(HasSubstr("reaches[0].from"), HasSubstr("j1_gantry"), HasSubstr("allowed: -0.45")));
  EXPECT_THAT(reaches_problem("reaches: [{from: [0,0,0,0,0,0,0], target: [0,0,0,0,0,0,0]}]"),
              HasSubstr("reaches[0].name"));
  EXPECT_THAT(reaches_problem("reaches: [{name: a, from: [0,0,0,0,0,0,.nan], target: [0,0,0,0,0,0,0]}]"),
              HasSubstr("finite"));
  const std::string pose = "from: [0,0,0,0,0,0,0], target: [0,0,0,0,0,0,0]";
  EXPECT_THAT(reaches_problem("reaches: [{name: a, " + pose + ", gripper: shut}]"),
              AllOf(HasSubstr("gripper"), HasSubstr("none, open, close")));
}

TEST(Reaches, OneAtLeastMustBeRepeated) {
  const auto file = test::new_file(
      "reaches: [{name: a, from: [0,0,0,0,0,0,0], target: [0,0,0,0,0,0,0], once: true, gripper: close, hold_s: 2, presses: true}]");
  const auto all = load_reaches(file, shipped_arm().arm);
  EXPECT_EQ(all.at(0).reach.gripper, simulation::GripperAction::kClose);
  EXPECT_EQ(all.at(0).reach.hold_s, 2.0);
  EXPECT_TRUE(all.at(0).reach.presses);
  EXPECT_THAT([&] { choose_reaches(runtime::Fields::from_text("only: []", "x.yaml", {"only: []"}), all); },
              ThrowsMessage<core::ConfigError>(HasSubstr("made once; allowed: at least one to repeat")));
}

}  // namespace
}  // namespace phantom::master_io

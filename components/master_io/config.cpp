#include "components/master_io/config.hpp"

#include <algorithm>

#include "common/robot/joint_values.hpp"
#include "common/runtime/config_reader.hpp"
#include "common/runtime/link_config.hpp"
#include "components/master_io/config_rendering.hpp"
#include "components/master_io/reaches.hpp"

namespace phantom::master_io {
namespace {

using runtime::ConfigReader;

void read_link(const ConfigReader& section, const robot::SerialArm& arm, Config& config) {
  config.link = runtime::read_link(section);
  config.align_tolerance = robot::by_joint_type(arm, section.number("tolerance_rad", 0.02, {1e-6, 1, "rad"}),
                                                section.number("tolerance_m", 0.008, {1e-6, 1, "m"}));
}

teleop::BilateralLaw read_law(const ConfigReader& file, const std::string& chosen) {
  const std::string in_file = file.choice("law", "sctfb", {"pf", "sctfb", "pfff", "pe", "peff"});
  const auto law = teleop::law_from_name(chosen.empty() ? in_file : chosen);
  if (law) return *law;
  throw file.error(
      "law",
      "is '" + chosen + "' on the command line; allowed: pf (case a), sctfb (b), pfff (c), pe (d), peff (e)");
}

void read_arm_of(const ConfigReader& section, const robot::SerialArm& arm, teleop::OperatorParameters& hand) {
  hand.stiffness = robot::by_joint_type(arm, section.number("stiffness_N_m_per_rad", {1e-3, 1e6, "N·m/rad"}),
                                        section.number("stiffness_N_per_m", {1e-3, 1e7, "N/m"}));
  hand.damping = robot::by_joint_type(arm, section.number("damping_N_m_s_per_rad", {0, 1e5, "N·m·s/rad"}),
                                      section.number("damping_N_s_per_m", {0, 1e6, "N·s/m"}));
  hand.max_force = robot::by_joint_type(arm, section.number("max_torque_N_m", {1e-3, 1e4, "N·m"}),
                                        section.number("max_force_N", {1e-3, 1e5, "N"}));
}

/// How a person slows down under load.
void read_caution(const ConfigReader& section, teleop::OperatorParameters& person) {
  person.yield_share = section.number("yield_share", person.yield_share, {0, 0.95, ""});
  person.stop_share = section.number("stop_share", person.stop_share, {0.01, 1, ""});
  if (person.stop_share <= person.yield_share)
    throw section.error("stop_share", "is not above yield_share; allowed: above it, up to 1");
  person.yield_bandwidth_Hz =
      section.number("yield_bandwidth_Hz", person.yield_bandwidth_Hz, {0.1, 50, "Hz"});
  person.recovery_bandwidth_Hz =
      section.number("recovery_bandwidth_Hz", person.yield_bandwidth_Hz, {0.01, 50, "Hz"});
  person.reaction_delay_s = section.number("reaction_delay_s", 0.0, {0, teleop::kLongestReaction_s, "s"});
}

void read_tremor(const ConfigReader& section, const robot::SerialArm& arm,
                 teleop::OperatorParameters& person) {
  person.tremor_rms = robot::by_joint_type(arm, section.number("rms_rad", 0.0, {0, 0.1, "rad"}),
                                           section.number("rms_m", 0.0, {0, 0.1, "m"}));
  person.tremor_Hz = section.number("centre_Hz", person.tremor_Hz, {1, 30, "Hz"});
  person.seed = static_cast<std::uint32_t>(section.integer("seed", 1, {0, 2e9, ""}));
}

teleop::OperatorParameters read_operator(const ConfigReader& section, const robot::SerialArm& arm,
                                         const std::string& chosen) {
  teleop::OperatorParameters person{.joint_count = arm.joint_count()},
      servo{.joint_count = arm.joint_count()};
  const std::string in_file =
      section.choice("model", "minimum_jerk", {"minimum_jerk", "cautious", "constant_velocity"});
  const std::string model = chosen.empty() ? in_file : chosen;
  if (model != "minimum_jerk" && model != "cautious" && model != "constant_velocity") {
    throw section.error(
        "model",
        "is '" + model + "' on the command line; allowed: minimum_jerk, cautious, constant_velocity");
  }
  const ConfigReader p = section.section("minimum_jerk"), c = section.optional_section("cautious"),
                     s = section.section("constant_velocity");
  read_arm_of(p, arm, person);
  read_caution(p, person);
  read_tremor(p.optional_section("tremor"), arm, person);
  teleop::OperatorParameters cautious = person;
  read_caution(c, cautious);
  servo.kind = teleop::OperatorKind::kConstantVelocity;
  read_arm_of(s, arm, servo);
  servo.velocity_ramp_share = s.number("ramp_share", servo.velocity_ramp_share, {0.01, 0.5, ""});
  if (model == "cautious") return cautious;
  return model == "minimum_jerk" ? person : servo;
}

DeskConfig read_desk(const ConfigReader& section, const robot::SerialArm& arm,
                     const std::string& chosen_device) {
  DeskConfig desk;
  desk.device = section.text("device", desk.device);
  if (!chosen_device.empty()) desk.device = chosen_device;
  desk.dead_zone = section.number("dead_zone", desk.dead_zone, {0, 0.9, ""});
  desk.exponent = section.number("exponent", desk.exponent, {1, 5, ""});
  desk.push = robot::by_joint_type(arm, section.number("push_N_m", 2.0, {1e-3, 1e3, "N·m"}),
                                   section.number("push_N", 30.0, {1e-3, 1e4, "N"}));
  desk.brake = robot::by_joint_type(arm, section.number("brake_N_m_s_per_rad", 4.0, {1e-3, 1e4, "N·m·s/rad"}),
                                    section.number("brake_N_s_per_m", 200.0, {1e-3, 1e6, "N·s/m"}));
  for (std::size_t first = 0; first < arm.joint_count(); first += kDeskAxes) {
    auto& bank = desk.banks.emplace_back();
    for (std::size_t k = 0; k < kDeskAxes; ++k)
      bank[k] = first + k < arm.joint_count() ? static_cast<int>(first + k) : -1;
  }
  return desk;
}

void read_can(const ConfigReader& section, const robot::SerialArm& arm, Config& config) {
  config.can = runtime::read_drives(section, arm, config.device.torque_limit_Nm, config.period_s);
  for (const can::AxisConfig& axis : config.can->group.axes) {
    if (axis.mode != can::DriveMode::kTorque)
      throw section.section("drives").section(axis.name).error(
          "mode", "does not let the master render torques; allowed: torque");
  }
}

teleop::ReachScriptParameters read_sequence(const ConfigReader& section, std::size_t joint_count) {
  teleop::ReachScriptParameters script;
  script.joint_count = joint_count;
  const std::string percept = section.choice("percept", "alternate", {"alternate", "on", "off"});
  script.percept = percept == "on"    ? teleop::PerceptSchedule::kOn
                   : percept == "off" ? teleop::PerceptSchedule::kOff
                                      : teleop::PerceptSchedule::kAlternate;
  script.first_wait_s = section.number("first_wait_s", script.first_wait_s, {0, 600, "s"});
  script.transit_s = section.number("transit_s", script.transit_s, {0.1, 600, "s"});
  script.in_s = section.number("in_s", script.in_s, {0.1, 600, "s"});
  script.hold_s = section.number("hold_s", script.hold_s, {0, 600, "s"});
  script.back_s = section.number("back_s", script.back_s, {0.1, 600, "s"});
  script.pause_s = section.number("pause_s", script.pause_s, {0, 600, "s"});
  script.overreach = section.number("overreach", script.overreach, {0, 1, ""});
  script.duration_scatter = section.number("duration_scatter", script.duration_scatter, {0, 0.3, ""});
  script.reaction_s = section.number("reaction_s", script.reaction_s, {0, 5, "s"});
  script.patience = section.number("patience", script.patience, {1, 100, ""});
  script.seed = static_cast<std::uint32_t>(section.integer("seed", 1, {0, 2e9, ""}));
  return script;
}

}  // namespace

std::string arm_name(const std::filesystem::path& file) {
  return ConfigReader::from_file(file).text("arm", "");
}

Config load_config(const std::filesystem::path& path, const std::filesystem::path& cell_file,
                   const robot::SerialArm& arm, const core::JointArray& home, const Choices& choices) {
  const ConfigReader file = ConfigReader::from_file(path);
  Config config;
  const std::string in_file = file.choice("driver", "sim", {"sim", "desk", "can"});
  const std::string driver = choices.driver.empty() ? in_file : choices.driver;
  config.driver = driver == "desk" ? Driver::kDesk : driver == "can" ? Driver::kCan : Driver::kSim;
  config.desk = read_desk(file.optional_section("desk"), arm, choices.desk_device);
  file.text("arm", "");
  config.period_s = 1.0 / file.number("rate_Hz", 1000, {50, 5000, "Hz"});
  config.scheduling.servo_priority = file.integer("fifo_priority", 0, {0, 99, ""});
  config.scheduling.lock_memory = file.flag("lock_memory", false);
  config.measure_bare_loop = file.flag("measure_bare_loop", true);
  read_link(file.optional_section("link"), arm, config);
  config.feedback.law = read_law(file, choices.law);
  read_device(file.section("device"), arm, config);
  if (config.driver == Driver::kCan || file.has("can")) read_can(file.section("can"), arm, config);
  read_percept(file.section("percept"), arm, config);
  read_feedback(file.section("feedback"), arm, home, config);
  if (config.driver == Driver::kSim || file.has("operator")) {
    const ConfigReader hand = file.section("operator");
    config.hand = read_operator(hand, arm, choices.operator_model);
    config.operator_model =
        choices.operator_model.empty() ? hand.text("model", "minimum_jerk") : choices.operator_model;
  } else {
    config.hand.joint_count = arm.joint_count();  // a person's own
  }
  const ConfigReader sequence = file.optional_section("sequence");
  config.script = read_sequence(sequence, arm.joint_count());
  sequence.has("only");  // read with the reaches
  const auto reaches_file = file.text("reaches_file", "").empty() ? cell_file.parent_path() / "reaches.yaml"
                                                                  : file.path("reaches_file");
  file.finish();
  for (const auto& reach : choose_reaches(sequence, load_reaches(reaches_file, arm))) {
    config.script.reaches.push_back(reach.reach);
    config.labels.push_back(reach.label);
  }
  return config;
}

}  // namespace phantom::master_io

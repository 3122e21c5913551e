#include "components/master_io/config.hpp"

#include "common/robot/kinematics/joint_values.hpp"
#include "common/runtime/configuration/drives_config.hpp"
#include "components/master_io/config_rendering.hpp"
#include "components/master_io/devices/desk_decode.hpp"
#include "components/master_io/reaches/reaches.hpp"

namespace phantom::master_io {
namespace {

using robot::by_joint_type;
using runtime::Fields;

void choose_law(const Fields& fields, const std::string& chosen, teleop::BilateralLaw& law) {
  std::vector<std::pair<const char*, teleop::BilateralLaw>> laws;
  for (std::size_t i = 0; i < teleop::kBilateralLaws; ++i) {
    const auto one = static_cast<teleop::BilateralLaw>(i);
    laws.emplace_back(teleop::name_of(one), one);
  }
  fields.choice("law", law, laws);
  if (chosen.empty()) return;
  const auto known = teleop::law_from_name(chosen);
  fields.check(
      known.has_value(), "law",
      "is '" + chosen + "' on the command line; allowed: pf (case a), sctfb (b), pfff (c), pe (d), peff (e)");
  law = known.value_or(law);
}

/// Coordinates in which a simulated person works: the arm's joints, or the axes of a Cartesian hand.
struct HandAxes {
  const robot::SerialArm& arm;
  bool cartesian;

  std::size_t count() const { return cartesian ? kCartesianAxes : arm.joint_count(); }
  core::JointArray by_type(double turning, double sliding) const {
    if (!cartesian) return by_joint_type(arm, turning, sliding);
    return {sliding, sliding, sliding, turning, turning, turning};
  }
};

void read_arm_of(const Fields& section, const HandAxes& axes, simulation::OperatorParameters& hand) {
  hand.stiffness = axes.by_type(section.value("stiffness_N_m_per_rad"), section.value("stiffness_N_per_m"));
  hand.damping = axes.by_type(section.value("damping_N_m_s_per_rad"), section.value("damping_N_s_per_m"));
  hand.max_force = axes.by_type(section.value("max_torque_N_m"), section.value("max_force_N"));
}

/// Reads how a simulated person slows down under load.
void read_caution(const Fields& section, simulation::OperatorParameters& person) {
  section.number("yield_share", person.yield_share);
  section.number("stop_share", person.stop_share);
  section.check(person.stop_share > person.yield_share, "stop_share",
                "is not above yield_share; allowed: above it, up to 1");
  section.number("yield_bandwidth_Hz", person.yield_bandwidth_Hz);
  person.recovery_bandwidth_Hz = person.yield_bandwidth_Hz;
  section.number("recovery_bandwidth_Hz", person.recovery_bandwidth_Hz);
  person.reaction_delay_s = 0.0;
  section.number("reaction_delay_s", person.reaction_delay_s);
}

/// Reads how a simulated person heeds what she hears or sees.
void read_attention(const Fields& section, simulation::Attention& attention) {
  section.number("heed_from", attention.heed_from);
  section.number("creep_from", attention.creep_from);
  section.check(attention.creep_from > attention.heed_from, "creep_from",
                "is not above heed_from; allowed: above it, up to 1");
  section.number("creep_pace", attention.creep_pace);
  section.number("reaction_delay_s", attention.reaction_delay_s);
}

void read_tremor(const Fields& section, const HandAxes& axes, simulation::OperatorParameters& person) {
  person.tremor_rms = axes.by_type(section.value("rms_rad", 0), section.value("rms_m", 0));
  section.number("centre_Hz", person.tremor_Hz);
  section.number("seed", person.seed);
}

void read_operator(const Fields& section, const HandAxes& axes, const std::string& chosen, Config& config) {
  simulation::OperatorParameters person{.joint_count = axes.count()},
      servo{.joint_count = axes.count(), .kind = simulation::OperatorKind::kConstantVelocity};
  std::string& model = config.operator_model = "minimum_jerk";
  section.choice("model", model,
                 {{"minimum_jerk", "minimum_jerk"},
                  {"cautious", "cautious"},
                  {"attentive", "attentive"},
                  {"constant_velocity", "constant_velocity"}});
  if (!chosen.empty()) model = chosen;
  const auto has = [&model](std::initializer_list<const char*> names) {
    return std::find(names.begin(), names.end(), model) != names.end();
  };
  section.check(has({"minimum_jerk", "cautious", "attentive", "constant_velocity"}), "model",
                "is '" + model +
                    "' on the command line; allowed: minimum_jerk, cautious, attentive, constant_velocity");
  const Fields p = section.section("minimum_jerk");
  read_arm_of(p, axes, person);
  read_caution(p, person);
  read_tremor(p.section("tremor"), axes, person);
  simulation::OperatorParameters cautious = person;
  read_caution(section.section("cautious"), cautious);
  simulation::OperatorParameters attentive = cautious;
  const Fields a = section.section("attentive");
  attentive.hearing = {.heed_from = 0.2, .creep_from = 0.7};
  attentive.sight = {.heed_from = 0.2, .creep_from = 0.7, .reaction_delay_s = 0.35};
  read_attention(a.section("hearing"), attentive.hearing);
  read_attention(a.section("sight"), attentive.sight);
  const Fields s = section.section("constant_velocity");
  read_arm_of(s, axes, servo);
  s.number("ramp_share", servo.velocity_ramp_share);
  config.hand = model == "cautious"       ? cautious
                : model == "attentive"    ? attentive
                : model == "minimum_jerk" ? person
                                          : servo;
}

/// Lays the desk's axes on the hand's: sticks on four joints at a time, or on the axes of a Cartesian hand.
/// `joints`: those that the master leads.
std::vector<std::array<int, kDeskAxes>> banks_of(const HandAxes& axes, bool space_mouse,
                                                 const std::vector<int>& joints) {
  if (space_mouse) return {{0, 1, 2, 3, 4, 5}};
  // Left stick: right, away; right stick: turned about the vertical, up. Then left stick: rolled, pitched.
  if (axes.cartesian) return {{0, 1, 5, 2, -1, -1}, {4, 3, -1, -1, -1, -1}};
  std::vector<std::array<int, kDeskAxes>> banks;
  for (std::size_t first = 0; first < joints.size(); first += kStickAxes) {
    auto& bank = banks.emplace_back();
    bank.fill(-1);
    for (std::size_t k = 0; k < kStickAxes && first + k < joints.size(); ++k) bank[k] = joints[first + k];
  }
  return banks;
}

bool is_led(const Config& config, std::size_t joint) {
  return !config.mapping || teleop::JointMapping(config.mapping->mapping).leads(joint);
}

/// A simulated hand pulls at nothing but what the master has.
void release_joints_not_led(Config& config) {
  for (std::size_t j = 0; j < config.hand.joint_count; ++j) {
    if (!is_led(config, j)) config.hand.stiffness[j] = config.hand.damping[j] = 0.0;
  }
}

void read_desk(const Fields& section, const HandAxes& axes, const std::string& chosen_device,
               Config& config) {
  DeskConfig& desk = config.desk;
  section.text("device", desk.device);
  if (!chosen_device.empty()) desk.device = chosen_device;
  desk.space_mouse = axes.cartesian && config.cartesian->input == CartesianInput::kSpaceMouse;
  section.number("dead_zone", desk.dead_zone);
  section.number("exponent", desk.exponent);
  desk.push = axes.by_type(section.value("push_N_m", 2), section.value("push_N", 30));
  desk.brake = axes.by_type(section.value("brake_N_m_s_per_rad", 4), section.value("brake_N_s_per_m", 200));
  std::vector<int> joints;
  for (std::size_t j = 0; j < axes.count(); ++j) {
    if (is_led(config, j)) joints.push_back(static_cast<int>(j));
  }
  desk.banks = banks_of(axes, desk.space_mouse, joints);
}

void read_can(const Fields& section, const robot::SerialArm& arm, Config& config) {
  config.can = config.mapping ? runtime::read_drives(section, config.mapping->joints,
                                                     config.mapping->device.torque_limit_Nm, config.period_s)
                              : runtime::read_drives(section, arm.joints(), config.device.torque_limit_Nm,
                                                     config.period_s);
  for (const can::AxisConfig& axis : config.can->group.axes) {
    if (axis.mode != can::DriveMode::kTorque)
      throw section.section("drives")
          .section(axis.name, "NAME")
          .error("mode", "does not let the master render torques; allowed: torque");
    if (axis.homing)
      throw section.section("drives")
          .section(axis.name, "NAME")
          .error("homing", "is for the drives of slave_io; allowed: a master whose encoders are absolute");
  }
}

void read_sequence(const Fields& section, simulation::ReachScriptParameters& script) {
  section.has("only");  // read together with the reaches
  using enum simulation::PerceptSchedule;
  section.choice("percept", script.percept, {{"alternate", kAlternate}, {"on", kOn}, {"off", kOff}});
  section.number("first_wait_s", script.first_wait_s);
  section.number("transit_s", script.transit_s);
  section.number("in_s", script.in_s);
  section.number("hold_s", script.hold_s);
  section.number("back_s", script.back_s);
  section.number("pause_s", script.pause_s);
  section.number("overreach", script.overreach);
  section.number("duration_scatter", script.duration_scatter);
  section.number("reaction_s", script.reaction_s);
  section.number("patience", script.patience);
  section.number("seed", script.seed);
}

/// A button of the device that also steers must mean nothing there.
void check_switch_keys(const Fields& file, const Config& config) {
  const auto& fitted = config.enabling_switch;
  if (!uses_desk(config) || !fitted || fitted->source != runtime::EnablingSwitchConfig::Source::kInput)
    return;
  const auto& keys = fitted->keys;
  if (keys.device != "auto" && keys.device != config.desk.device) return;
  const auto free = [&config](int code) { return code < 0 || !is_desk_key(code, config.desk.space_mouse); };
  file.check(
      free(keys.key) && free(keys.through_key), "enabling_switch",
      "has a key that means something else at the desk; allowed: another button, such as BTN_THUMBR or "
      "BTN_TR2, or one of another device, by its name");
}

Driver driver_of(const Fields& file, const std::string& chosen) {
  Driver driver = Driver::kSim;
  std::vector<std::pair<const char*, Driver>> all;
  for (const Driver one : {Driver::kSim, Driver::kDesk, Driver::kCan, Driver::kCartesian})
    all.emplace_back(name_of(one), one);
  file.choice("driver", driver, all);
  for (const auto& [name, one] : all) {
    if (chosen == name) driver = one;
  }
  return driver;
}

/// Puts the reaches, and where the hand begins, into the coordinates of a Cartesian hand.
void reach_in_space(const robot::SerialArm& arm, const core::JointArray& home, Config& config) {
  const Eigen::Matrix3d R_home = tool_pose_at(arm, home).rotation;
  const auto in_space = [&](const core::JointArray& q) {
    return tool_coordinates(*config.cartesian, R_home, tool_pose_at(arm, q));
  };
  for (auto& reach : config.script.reaches)
    reach.from = in_space(reach.from), reach.target = in_space(reach.target);
  config.hand_start = in_space(home);
}

}  // namespace

const char* name_of(Driver driver) noexcept {
  switch (driver) {
    case Driver::kDesk:
      return "desk";
    case Driver::kCan:
      return "can";
    case Driver::kCartesian:
      return "cartesian";
    default:
      return "sim";
  }
}

Config load_config(const std::filesystem::path& path, const std::filesystem::path& cell_file,
                   const robot::SerialArm& arm, const core::JointArray& home, const Choices& choices) {
  const Fields file(path, {kParameters, runtime::kDriveParameters, runtime::kSwitchParameters});
  Config config;
  config.driver = driver_of(file, choices.driver);
  config.period_s = runtime::read_servo_loop(file, config.scheduling, config.measure_bare_loop);
  const Fields link = file.section("link");
  runtime::read_link(link, config.link);
  runtime::read_loop_guard(file.section("loop"), config.period_s, config.loop);
  config.align_tolerance =
      by_joint_type(arm, link.value("tolerance_rad", 0.02), link.value("tolerance_m", 0.008));
  choose_law(file, choices.law, config.feedback.law);
  if (file.has("joint_mapping")) {
    file.check(config.driver != Driver::kCartesian, "joint_mapping",
               "is for a master that has joints; allowed: driver sim, desk or can");
    config.mapping = read_mapping(file.section("joint_mapping"), arm, config.align_tolerance);
  }
  read_device(file.section("device"), arm, config);
  if (config.driver == Driver::kCan || file.has("can")) read_can(file.section("can"), arm, config);
  config.enabling_switch = runtime::read_enabling_switch(file, config.can);
  if (config.driver == Driver::kCartesian || file.has("cartesian")) {
    core::JointArray inertia{};
    for (std::size_t j = 0; j < arm.joint_count(); ++j) inertia[j] = config.device.joints[j].inertia;
    config.cartesian = read_cartesian(file.section("cartesian"), arm, inertia,
                                      (config.command_delay_samples + 1) * config.period_s);
  }
  read_percept(file.section("percept"), arm, config);
  read_feedback(file.section("feedback"), arm, home, config);
  const HandAxes axes{arm, config.driver == Driver::kCartesian};
  read_desk(file.section("desk"), axes, choices.desk_device, config);
  check_switch_keys(file, config);
  config.hand.joint_count = axes.count();  // used for a person; a simulated operator's is read below
  if (is_scripted(config) || file.has("operator"))
    read_operator(file.section("operator"), axes, choices.operator_model, config);
  release_joints_not_led(config);
  const Fields sequence = file.section("sequence");
  config.script.joint_count = axes.count();
  read_sequence(sequence, config.script);
  std::string reaches;
  file.text("reaches_file", reaches);
  file.finish();
  const auto reaches_file =
      reaches.empty() ? cell_file.parent_path() / "reaches.yaml" : file.existing_file("reaches_file");
  if (reaches.empty() && !std::filesystem::exists(reaches_file)) {
    throw core::MissingError(
        reaches_file.string() +
        " is not there: the simulated operator's reaches, beside the cell file. Write it "
        "(--help-reaches has its keys), or name another by reaches_file in " +
        path.string());
  }
  for (const auto& reach : choose_reaches(sequence, load_reaches(reaches_file, arm))) {
    config.script.reaches.push_back(reach.reach);
    config.labels.push_back(reach.label);
  }
  if (axes.cartesian) reach_in_space(arm, home, config);
  return config;
}

}  // namespace phantom::master_io

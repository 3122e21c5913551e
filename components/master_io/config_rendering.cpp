#include "components/master_io/config_rendering.hpp"

#include <string>
#include <vector>

#include "common/robot/joint_values.hpp"
#include "common/teleop/feedback_limit.hpp"
#include "common/teleop/joint_servo.hpp"
#include "common/teleop/slave_plant.hpp"
#include "common/teleop/stability_guard.hpp"

namespace phantom::master_io {
namespace {

using runtime::ConfigReader;

/// Calls set(joint, its own mapping) for each joint that the section `joints` names.
template <class Set>
void for_single_joints(const ConfigReader& section, const robot::SerialArm& arm, Set set) {
  const ConfigReader joints = section.optional_section("joints");
  for (std::size_t j = 0; j < arm.joint_count(); ++j) {
    const std::string& name = arm.joints()[j].name;
    if (joints.has(name)) set(j, joints.section(name));
  }
}

/// Damping that the device renders stably: decides how much of the percept gets through.
core::JointArray damping_limit(const Config& config, const core::JointArray& cap) {
  teleop::DeviceDamping device{.joint_count = config.device.joint_count,
                               .inertia = {},
                               .damping_cap = cap,
                               .period_s = config.period_s,
                               .delay_samples = config.command_delay_samples};
  device.delay_samples += teleop::filter_delay_samples(config.device.velocity_filter_s, config.period_s);
  for (std::size_t j = 0; j < device.joint_count; ++j) device.inertia[j] = config.device.joints[j].inertia;
  return teleop::usable_damping(device);
}

/// D is scaled as a whole: a joint that may not be damped at all would take the percept from all others.
void check_coupled(const ConfigReader& section, const robot::SerialArm& arm,
                   const teleop::PerceptParameters& percept) {
  if (percept.mode != teleop::DragMode::kCoupled) return;
  for (std::size_t j = 0; j < percept.joint_count; ++j) {
    if (percept.damping_limit_Nms_per_rad[j] <= 0.0)
      throw section.error("mode", "is coupled, but the device may not damp " + arm.joints()[j].name +
                                      " at all (its damping cap is 0); allowed: separable");
  }
}

void read_exchange(const ConfigReader& section, const robot::SerialArm& arm, teleop::ExchangeGains& gains) {
  gains.k_p = robot::by_joint_type(arm, section.number("k_p_N_m_per_rad", {0, 1e5, "N·m/rad"}),
                                   section.number("k_p_N_per_m", {0, 1e7, "N/m"}));
  gains.k_v = robot::by_joint_type(arm, section.number("k_v_N_m_s_per_rad", {0, 1e4, "N·m·s/rad"}),
                                   section.number("k_v_N_s_per_m", {0, 1e6, "N·s/m"}));
  gains.force_share = section.number("force_share", {0, 10, ""});
}

/// The guard may add as much damping as the percept may: together they stay within the device's stability.
void read_passivity(const ConfigReader& section, const robot::SerialArm& arm, Config& config) {
  auto& passivity = config.feedback.passivity;
  passivity.joint_count = arm.joint_count();
  passivity.enabled = section.flag("guard", true);
  passivity.allowance_J = teleop::everywhere(section.number("allowance_J", {0, 1e3, "J"}));
  passivity.store_J = teleop::everywhere(section.number("store_J", {0, 1e3, "J"}));
  passivity.damping_limit = config.percept.damping_limit_Nms_per_rad;
}

void read_contact(const ConfigReader& contact, Config& config) {
  auto& feedback = config.feedback;
  const std::string source = contact.choice("source", "either", {"slave", "phantom", "either"});
  config.contact_source = source == "slave"     ? ContactSource::kSlave
                          : source == "phantom" ? ContactSource::kPhantom
                                                : ContactSource::kEither;
  feedback.contact_gain_ratio = contact.number("gain_ratio", 1.0, {1, 100, ""});
  feedback.contact_rise_s = contact.number("rise_s", feedback.contact_rise_s, {0.005, 5, "s"});
  feedback.contact_fall_s = contact.number("fall_s", feedback.contact_fall_s, {0.005, 5, "s"});
}

void read_inverse_a(const ConfigReader& section, const robot::SerialArm& arm,
                    teleop::FeedbackParameters& feedback) {
  const auto name = [](std::size_t law) { return teleop::name_of(static_cast<teleop::BilateralLaw>(law)); };
  const ConfigReader by_law = section.section("inverse_a");
  for (std::size_t law = 1; law < teleop::kBilateralLaws; ++law)
    feedback.inverse_a[law] = teleop::everywhere(by_law.number(name(law), {0, 10, ""}));
  for_single_joints(section, arm, [&](std::size_t j, const ConfigReader& own) {
    const ConfigReader own_by_law = own.optional_section("inverse_a");
    for (std::size_t law = 1; law < teleop::kBilateralLaws; ++law) {
      double& value = feedback.inverse_a[law][j];
      value = own_by_law.number(name(law), value, {0, 10, ""});
    }
    feedback.torque_cap_Nm[j] = own.number("torque_cap", feedback.torque_cap_Nm[j], {0, 1e5, "N·m or N"});
    auto& exchange = feedback.exchange;
    exchange.k_p[j] = own.number("k_p", exchange.k_p[j], {0, 1e7, "N·m/rad or N/m"});
    exchange.k_v[j] = own.number("k_v", exchange.k_v[j], {0, 1e6, "N·m·s/rad or N·s/m"});
  });
}

/// What the feedback's loop consists of, joint by joint: this device, and the slave as section `slave` has
/// it.
std::vector<teleop::FeedbackLoop> read_loops(const ConfigReader& slave, const robot::SerialArm& arm,
                                             const core::JointArray& home, const Config& config) {
  const double bandwidth_Hz = slave.number("bandwidth_Hz", {0.1, 100, "Hz"});
  const double damping = slave.number("damping_ratio", 1.0, {0.1, 10, ""});
  const auto rotor = robot::by_joint_type(arm, slave.number("rotor_inertia_kg_m2", {1e-4, 1e4, "kg·m²"}),
                                          slave.number("rotor_mass_kg", {1e-3, 1e5, "kg"}));
  const auto inertia = teleop::reflected_inertia(arm, home, rotor);
  const double period_s = 1.0 / slave.number("rate_Hz", 1000, {50, 5000, "Hz"});
  const double filter_s = slave.number("velocity_filter_s", 0.002, {0, 0.1, "s"});
  const int delay = slave.integer("command_delay_samples", 0, {0, 100, "samples"});
  std::vector<teleop::FeedbackLoop> loops;
  for (std::size_t j = 0; j < arm.joint_count(); ++j) {
    const auto gains = teleop::gains_for(inertia[j], bandwidth_Hz, damping, 0.0);
    const auto& exchange = config.feedback.exchange;
    loops.push_back({.master_inertia = config.device.joints[j].inertia,
                     .master_period_s = config.period_s,
                     .master_delay_samples = config.command_delay_samples,
                     .master_filter_s = config.device.velocity_filter_s,
                     .slave_inertia = inertia[j],
                     .slave_k_p = gains.k_p,
                     .slave_k_v = gains.k_v,
                     .slave_period_s = period_s,
                     .slave_delay_samples = delay,
                     .slave_filter_s = filter_s,
                     .exchange_k_p = exchange.k_p[j],
                     .exchange_k_v = exchange.k_v[j],
                     .force_share = exchange.force_share});
  }
  for_single_joints(slave, arm, [&](std::size_t j, const ConfigReader& own) {
    loops[j].slave_k_p = own.number("k_p", {0, 1e7, "N·m/rad or N/m"});
    loops[j].slave_k_v = own.number("k_v", {0, 1e6, "N·m·s/rad or N·s/m"});
  });
  return loops;
}

/// Every law: it may change while running.
void check_stability(const ConfigReader& section, const robot::SerialArm& arm,
                     const teleop::FeedbackParameters& feedback) {
  const auto names = joint_names(arm);
  for (std::size_t i = 1; i < teleop::kBilateralLaws; ++i) {
    const auto law = static_cast<teleop::BilateralLaw>(i);
    const std::string why =
        teleop::why_feedback_is_unstable(feedback.limits, law, feedback.inverse_a[i],
                                         feedback.contact_gain_ratio, feedback.expected_round_trip_s, names);
    if (!why.empty()) throw section.section("inverse_a").error(teleop::name_of(law), "cannot be: " + why);
  }
}

}  // namespace

std::vector<std::string> joint_names(const robot::SerialArm& arm) {
  std::vector<std::string> names;
  for (const auto& joint : arm.joints()) names.push_back(joint.name);
  return names;
}

void read_device(const ConfigReader& section, const robot::SerialArm& arm, Config& config) {
  auto& device = config.device;
  device.joint_count = arm.joint_count();
  device.velocity_filter_s = section.number("velocity_filter_s", 0.002, {0, 0.1, "s"});
  config.command_delay_samples = section.integer("command_delay_samples", 1, {0, 100, "samples"});
  const ConfigReader r = section.section("revolute"), p = section.section("prismatic");
  auto inertia = robot::by_joint_type(arm, r.number("inertia_kg_m2", {1e-6, 1e4, "kg·m²"}),
                                      p.number("mass_kg", {1e-4, 1e5, "kg"}));
  auto viscous = robot::by_joint_type(arm, r.number("viscous_N_m_s_per_rad", {0, 1e4, "N·m·s/rad"}),
                                      p.number("viscous_N_s_per_m", {0, 1e5, "N·s/m"}));
  auto coulomb = robot::by_joint_type(arm, r.number("coulomb_N_m", {0, 1e4, "N·m"}),
                                      p.number("coulomb_N", {0, 1e5, "N"}));
  device.torque_limit_Nm = robot::by_joint_type(arm, r.number("torque_limit_N_m", {0, 1e4, "N·m"}),
                                                p.number("force_limit_N", {0, 1e5, "N"}));
  config.torque_rate_Nm_per_s =
      robot::by_joint_type(arm, r.number("torque_rate_N_m_per_s", {0.1, 1e6, "N·m/s"}),
                           p.number("force_rate_N_per_s", {1, 1e7, "N/s"}));
  device.encoder_resolution = robot::by_joint_type(arm, r.number("encoder_step_rad", {1e-9, 0.1, "rad"}),
                                                   p.number("encoder_step_m", {1e-9, 0.1, "m"}));
  auto cap = robot::by_joint_type(arm, r.number("damping_cap_N_m_s_per_rad", {0, 1e4, "N·m·s/rad"}),
                                  p.number("damping_cap_N_s_per_m", {0, 1e6, "N·s/m"}));
  for_single_joints(section, arm, [&](std::size_t j, const ConfigReader& own) {
    inertia[j] = own.number("inertia", inertia[j], {1e-6, 1e5, "kg·m² or kg"});
    viscous[j] = own.number("viscous", viscous[j], {0, 1e5, "N·m·s/rad or N·s/m"});
    coulomb[j] = own.number("coulomb", coulomb[j], {0, 1e5, "N·m or N"});
    device.torque_limit_Nm[j] = own.number("torque_limit", device.torque_limit_Nm[j], {0, 1e5, "N·m or N"});
    auto& rate = config.torque_rate_Nm_per_s[j];
    rate = own.number("torque_rate", rate, {0.1, 1e7, "N·m/s or N/s"});
    cap[j] = own.number("damping_cap", cap[j], {0, 1e6, "N·m·s/rad or N·s/m"});
    device.encoder_resolution[j] =
        own.number("encoder_step", device.encoder_resolution[j], {1e-9, 0.1, "rad or m"});
  });
  for (std::size_t j = 0; j < arm.joint_count(); ++j) {
    const auto& joint = arm.joints()[j];
    device.joints[j] = {inertia[j], viscous[j], coulomb[j], joint.lower, joint.upper};
  }
  config.percept.damping_limit_Nms_per_rad = damping_limit(config, cap);
}

void read_percept(const ConfigReader& section, const robot::SerialArm& arm, Config& config) {
  auto& percept = config.percept;
  percept.joint_count = arm.joint_count();
  percept.mode = section.choice("mode", "separable", {"separable", "coupled"}) == "coupled"
                     ? teleop::DragMode::kCoupled
                     : teleop::DragMode::kSeparable;
  config.percept_gain = teleop::everywhere(section.number("gain", {0, 1000, ""}));
  config.percept_staleness_s = section.number("staleness_s", config.percept_staleness_s, {0.002, 2, "s"});
  percept.torque_cap_Nm = robot::by_joint_type(arm, section.number("torque_cap_N_m", {0, 1e4, "N·m"}),
                                               section.number("force_cap_N", {0, 1e5, "N"}));
  for_single_joints(section, arm, [&](std::size_t j, const ConfigReader& own) {
    config.percept_gain[j] = own.number("gain", config.percept_gain[j], {0, 1000, ""});
    percept.torque_cap_Nm[j] = own.number("torque_cap", percept.torque_cap_Nm[j], {0, 1e5, "N·m or N"});
  });
  percept.smoothing_s = section.number("smoothing_s", percept.smoothing_s, {0, 1, "s"});
  percept.ramp_up_s = section.number("ramp_up_s", percept.ramp_up_s, {0.01, 10, "s"});
  percept.ramp_down_s = section.number("ramp_down_s", percept.ramp_down_s, {0.01, 2, "s"});
  check_coupled(section, arm, percept);
}

void read_feedback(const ConfigReader& section, const robot::SerialArm& arm, const core::JointArray& home,
                   Config& config) {
  auto& feedback = config.feedback;
  feedback.joint_count = arm.joint_count();
  read_exchange(section.section("exchange"), arm, feedback.exchange);
  feedback.torque_cap_Nm = robot::by_joint_type(arm, section.number("torque_cap_N_m", {0, 1e4, "N·m"}),
                                                section.number("force_cap_N", {0, 1e5, "N"}));
  read_inverse_a(section, arm, feedback);
  feedback.ramp_up_s = section.number("ramp_up_s", feedback.ramp_up_s, {0.01, 10, "s"});
  feedback.ramp_down_s = section.number("ramp_down_s", feedback.ramp_down_s, {0.01, 2, "s"});
  read_contact(section.optional_section("contact"), config);
  read_passivity(section.section("passivity"), arm, config);
  feedback.expected_round_trip_s = section.number("expected_round_trip_s", feedback.expected_round_trip_s,
                                                  {teleop::FeedbackLimits::kShortest_s, 0.1, "s"});
  config.feedback_loops = read_loops(section.section("slave"), arm, home, config);
  feedback.limits = teleop::FeedbackLimits(config.feedback_loops);
  check_stability(section, arm, feedback);
}

}  // namespace phantom::master_io

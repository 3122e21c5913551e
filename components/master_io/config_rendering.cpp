#include "components/master_io/config_rendering.hpp"

#include <string>
#include <vector>

#include "common/robot/kinematics/joint_values.hpp"
#include "common/runtime/configuration/drives_config.hpp"
#include "common/simulation/reflected_inertia.hpp"
#include "common/teleop/coupling/joint_servo.hpp"
#include "common/teleop/guards/stability_guard.hpp"
#include "common/teleop/rendering/feedback_limit.hpp"

namespace phantom::master_io {
namespace {

using robot::by_joint_type;
using runtime::Fields;

constexpr double kDragFloorShare = 0.02;  // of a joint's cap: the outermost layer at a slow hand

/// Returns the damping that the device renders stably; it bounds the rendered percept.
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

/// Refuses coupled drag with an undampable joint: D is scaled as a whole, so the percept would vanish on all
/// joints.
void check_coupled(const Fields& section, const robot::SerialArm& arm,
                   const teleop::PerceptParameters& percept) {
  if (percept.mode != teleop::DragMode::kCoupled) return;
  for (std::size_t j = 0; j < percept.joint_count; ++j) {
    section.check(percept.damping_limit_Nms_per_rad[j] > 0.0, "mode",
                  "is coupled, but the device may not damp " + arm.joints()[j].name +
                      " at all (its damping cap is 0); allowed: separable");
  }
}

void read_exchange(const Fields& section, const robot::SerialArm& arm, teleop::ExchangeGains& gains) {
  gains.k_p = by_joint_type(arm, section.value("k_p_N_m_per_rad"), section.value("k_p_N_per_m"));
  gains.k_v = by_joint_type(arm, section.value("k_v_N_m_s_per_rad"), section.value("k_v_N_s_per_m"));
  section.number("force_share", gains.force_share);
}

/// Lets the guard add as much damping as the percept may; together they stay within the device's stability
/// limit.
void read_passivity(const Fields& section, const robot::SerialArm& arm, Config& config) {
  auto& passivity = config.feedback.passivity;
  passivity.joint_count = arm.joint_count();
  passivity.damping_limit = config.percept.damping_limit_Nms_per_rad;
  section.flag("guard", passivity.enabled);
  passivity.allowance_J = teleop::everywhere(section.value("allowance_J"));
  passivity.store_J = teleop::everywhere(section.value("store_J"));
}

void read_contact(const Fields& contact, Config& config) {
  auto& feedback = config.feedback;
  using enum ContactSource;
  contact.choice("source", config.contact_source,
                 {{"slave", kSlave}, {"phantom", kPhantom}, {"either", kEither}});
  contact.number("gain_ratio", feedback.contact_gain_ratio);
  contact.number("rise_s", feedback.contact_rise_s);
  contact.number("fall_s", feedback.contact_fall_s);
}

void read_inverse_a(const Fields& section, const robot::SerialArm& arm,
                    teleop::FeedbackParameters& feedback) {
  const auto name = [](std::size_t law) { return teleop::name_of(static_cast<teleop::BilateralLaw>(law)); };
  const Fields by_law = section.section("inverse_a");
  for (std::size_t law = 1; law < teleop::kBilateralLaws; ++law)
    feedback.inverse_a[law] = teleop::everywhere(by_law.value(name(law)));
  section.named("joints", runtime::joint_names(arm), [&](const Fields& own, std::size_t j) {
    const Fields own_by_law = own.section("inverse_a");
    for (std::size_t law = 1; law < teleop::kBilateralLaws; ++law)
      own_by_law.number(name(law), feedback.inverse_a[law][j]);
    own.number("torque_cap", feedback.torque_cap_Nm[j]);
    own.number("k_p", feedback.exchange.k_p[j]);
    own.number("k_v", feedback.exchange.k_v[j]);
  });
}

/// Returns each joint's feedback loop, made of this device and of the slave that section `slave` describes.
std::vector<teleop::FeedbackLoop> read_loops(const Fields& slave, const robot::SerialArm& arm,
                                             const core::JointArray& home, const Config& config) {
  teleop::FeedbackLoop as_all{.master_period_s = config.period_s,
                              .master_delay_samples = config.command_delay_samples,
                              .master_filter_s = config.device.velocity_filter_s,
                              .slave_period_s = 1.0 / slave.value("rate_Hz", 1000),
                              .slave_filter_s = slave.value("velocity_filter_s", 0.002),
                              .force_lag_s = slave.value("force_lag_s"),
                              .force_share = config.feedback.exchange.force_share};
  slave.number("command_delay_samples", as_all.slave_delay_samples);
  const double bandwidth_Hz = slave.value("bandwidth_Hz"), damping = slave.value("damping_ratio", 1.0);
  const auto rotor = by_joint_type(arm, slave.value("rotor_inertia_kg_m2"), slave.value("rotor_mass_kg"));
  std::vector<teleop::FeedbackLoop> loops(arm.joint_count(), as_all);
  const auto inertia = simulation::reflected_inertia(arm, home, rotor);
  for (std::size_t j = 0; j < arm.joint_count(); ++j) {
    const auto gains = teleop::gains_for(inertia[j], bandwidth_Hz, damping, 0.0);
    loops[j].master_inertia = config.device.joints[j].inertia;
    loops[j].slave_inertia = inertia[j];
    loops[j].slave_k_p = gains.k_p;
    loops[j].slave_k_v = gains.k_v;
    loops[j].exchange_k_p = config.feedback.exchange.k_p[j];
    loops[j].exchange_k_v = config.feedback.exchange.k_v[j];
  }
  slave.named("joints", runtime::joint_names(arm), [&](const Fields& own, std::size_t j) {
    own.number("k_p", loops[j].slave_k_p);
    own.number("k_v", loops[j].slave_k_v);
  });
  return loops;
}

/// Checks every law, because the law may change during operation.
void check_stability(const Fields& section, const robot::SerialArm& arm,
                     const teleop::FeedbackParameters& feedback) {
  const auto names = runtime::joint_names(arm);
  for (std::size_t i = 1; i < teleop::kBilateralLaws; ++i) {
    const auto law = static_cast<teleop::BilateralLaw>(i);
    const std::string why =
        teleop::why_feedback_is_unstable(feedback.limits, law, feedback.inverse_a[i],
                                         feedback.contact_gain_ratio, feedback.expected_round_trip_s, names);
    if (!why.empty()) throw section.section("inverse_a").error(teleop::name_of(law), "cannot be: " + why);
  }
}

}  // namespace

void read_device(const Fields& section, const robot::SerialArm& arm, Config& config) {
  auto& device = config.device;
  device.joint_count = arm.joint_count();
  section.number("velocity_filter_s", device.velocity_filter_s);
  section.number("command_delay_samples", config.command_delay_samples);
  const Fields r = section.section("revolute"), p = section.section("prismatic");
  const auto both = [&](double revolute, double prismatic) {
    return by_joint_type(arm, revolute, prismatic);
  };
  ReflectedMaster m{
      .inertia = both(r.value("inertia_kg_m2"), p.value("mass_kg")),
      .viscous = both(r.value("viscous_N_m_s_per_rad"), p.value("viscous_N_s_per_m")),
      .coulomb = both(r.value("coulomb_N_m"), p.value("coulomb_N")),
      .torque_limit = both(r.value("torque_limit_N_m"), p.value("force_limit_N")),
      .torque_rate = both(r.value("torque_rate_N_m_per_s"), p.value("force_rate_N_per_s")),
      .damping_cap = both(r.value("damping_cap_N_m_s_per_rad"), p.value("damping_cap_N_s_per_m")),
      .encoder_step = both(r.value("encoder_step_rad"), p.value("encoder_step_m"))};
  section.named("joints", runtime::joint_names(arm), [&](const Fields& own, std::size_t j) {
    section.check(
        !config.mapping, "joints",
        "stands beside joint_mapping; allowed: the values of joints there, by the joint that is led");
    own.number("inertia", m.inertia[j]);
    own.number("viscous", m.viscous[j]);
    own.number("coulomb", m.coulomb[j]);
    own.number("torque_limit", m.torque_limit[j]);
    own.number("torque_rate", m.torque_rate[j]);
    own.number("damping_cap", m.damping_cap[j]);
    own.number("encoder_step", m.encoder_step[j]);
  });
  if (config.mapping) {
    config.mapping->device.velocity_filter_s = device.velocity_filter_s;
    reflect(*config.mapping, m);
  }
  for (std::size_t j = 0; j < arm.joint_count(); ++j) {
    const auto& joint = arm.joints()[j];
    device.joints[j] = {m.inertia[j], m.viscous[j], m.coulomb[j], joint.lower, joint.upper};
  }
  device.torque_limit_Nm = m.torque_limit;
  device.encoder_resolution = m.encoder_step;
  config.torque_rate_Nm_per_s = m.torque_rate;
  config.percept.damping_limit_Nms_per_rad = damping_limit(config, m.damping_cap);
}

void read_percept(const Fields& section, const robot::SerialArm& arm, Config& config) {
  auto& percept = config.percept;
  percept.joint_count = arm.joint_count();
  section.choice("mode", percept.mode,
                 {{"separable", teleop::DragMode::kSeparable}, {"coupled", teleop::DragMode::kCoupled}});
  std::string set = "all";
  section.text("set", set);
  const auto number = teleop::percepts_from_name(set);
  section.check(number.has_value(), "set",
                std::string("is no choice of percepts; allowed: ") + teleop::kPerceptNames);
  config.percepts = *number;
  config.percept_gain = teleop::everywhere(section.value("gain"));
  section.number("staleness_s", config.percept_staleness_s);
  percept.torque_cap_Nm = by_joint_type(arm, section.value("torque_cap_N_m"), section.value("force_cap_N"));
  section.named("joints", runtime::joint_names(arm), [&](const Fields& own, std::size_t j) {
    own.number("gain", config.percept_gain[j]);
    own.number("torque_cap", percept.torque_cap_Nm[j]);
  });
  section.number("weber_fraction", config.masking.weber_fraction);
  config.masking.joint_count = percept.joint_count;
  for (std::size_t j = 0; j < percept.joint_count; ++j)
    config.masking.drag_floor_Nm[j] = kDragFloorShare * percept.torque_cap_Nm[j];
  section.number("smoothing_s", percept.smoothing_s);
  section.number("ramp_up_s", percept.ramp_up_s);
  section.number("ramp_down_s", percept.ramp_down_s);
  check_coupled(section, arm, percept);
}

void read_feedback(const Fields& section, const robot::SerialArm& arm, const core::JointArray& home,
                   Config& config) {
  auto& feedback = config.feedback;
  feedback.joint_count = arm.joint_count();
  read_exchange(section.section("exchange"), arm, feedback.exchange);
  feedback.torque_cap_Nm = by_joint_type(arm, section.value("torque_cap_N_m"), section.value("force_cap_N"));
  read_inverse_a(section, arm, feedback);
  section.number("ramp_up_s", feedback.ramp_up_s);
  section.number("ramp_down_s", feedback.ramp_down_s);
  read_contact(section.section("contact"), config);
  read_passivity(section.section("passivity"), arm, config);
  section.number("reaction_gain", config.reaction_gain);
  section.number("expected_round_trip_s", feedback.expected_round_trip_s);
  config.feedback_loops = read_loops(section.section("slave"), arm, home, config);
  feedback.limits = teleop::FeedbackLimits(config.feedback_loops);
  check_stability(section, arm, feedback);
}

}  // namespace phantom::master_io

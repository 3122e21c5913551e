#include "components/master_io/config_mapping.hpp"

#include <algorithm>
#include <cmath>

#include "common/core/text.hpp"
#include "common/runtime/cell/arm_file.hpp"
#include "common/runtime/cell/arm_model.hpp"
#include "common/runtime/configuration/drives_config.hpp"

namespace phantom::master_io {
namespace {

using runtime::Fields;

std::string range_text(double from, double to) { return core::formatted("%.4g to %.4g", from, to); }

/// The master's joint that the key names, which nothing leads with yet.
const robot::Joint& leader(const Fields& own, const robot::SerialArm& master, const MappingConfig& config) {
  const std::string name = own.text("led_by");
  const auto& joints = master.joints();
  const auto found = std::ranges::find(joints, name, &robot::Joint::name);
  own.check(found != joints.end(), "led_by",
            "is no joint of the master; allowed: " + core::listed(joints, &robot::Joint::name));
  own.check(std::ranges::find(config.joints, name, &robot::Joint::name) == config.joints.end(), "led_by",
            "leads another joint already; allowed: each joint of the master once");
  own.check(std::isfinite(found->lower) && std::isfinite(found->upper), "led_by",
            "has no range in the master's description; allowed: a joint with limits");
  own.check(found->max_effort > 0.0, "led_by",
            "has no greatest torque in the master's description; allowed: a joint with one above 0");
  return *found;
}

/// The arm's joint must be able to follow wherever the master's can go.
void check_range(const Fields& own, const teleop::LedJoint& led, const robot::Joint& master,
                 const robot::Joint& arm) {
  const double a = led.at_zero + led.ratio * master.lower, b = led.at_zero + led.ratio * master.upper;
  own.check(std::min(a, b) >= arm.lower && std::max(a, b) <= arm.upper, "ratio",
            "lets " + master.name + " lead " + arm.name + " from " +
                range_text(std::min(a, b), std::max(a, b)) + "; allowed with at_zero: within " +
                range_text(arm.lower, arm.upper));
}

void read_led_joint(const Fields& own, const robot::SerialArm& arm, std::size_t j,
                    const robot::SerialArm& master, MappingConfig& config) {
  const robot::Joint& joint = leader(own, master, config);
  const std::size_t m = config.mapping.master_joints++;
  teleop::LedJoint& led = config.mapping.led[m];
  led = {.arm_joint = j, .ratio = own.value("ratio"), .at_zero = own.value("at_zero")};
  own.check(led.ratio != 0.0, "ratio", "leads nothing; allowed: above or below 0");
  check_range(own, led, joint, arm.joints()[j]);
  config.joints.push_back(joint);
  config.leads.push_back(arm.joints()[j].name);
  auto& mechanics = config.device.joints[m];
  mechanics.inertia = own.value("inertia");
  own.number("viscous", mechanics.viscous);
  own.number("coulomb", mechanics.coulomb);
  mechanics.lower = joint.lower;
  mechanics.upper = joint.upper;
  config.device.torque_limit_Nm[m] = joint.max_effort;
  config.torque_rate[m] = own.value("torque_rate");
  config.damping_cap[m] = own.value("damping_cap");
  config.device.encoder_resolution[m] = own.value("encoder_step");
  own.number("lever_m", config.lever_m[m]);
}

void read_held(const Fields& section, const robot::SerialArm& arm, MappingConfig& config) {
  std::map<std::string, double> held;
  section.numbers("held", held);
  const teleop::JointMapping mapping(config.mapping);
  for (const auto& [name, q] : held) {
    const auto& joints = arm.joints();
    const auto found = std::ranges::find(joints, name, &robot::Joint::name);
    section.check(found != joints.end(), "held",
                  "names " + name + ", which is no joint of the arm; allowed: " +
                      core::listed(joints, &robot::Joint::name));
    const auto j = static_cast<std::size_t>(found - joints.begin());
    section.check(!mapping.leads(j), "held",
                  "names " + name + ", which the master leads; allowed: the arm's other joints");
    section.check(
        q >= found->lower && q <= found->upper, "held",
        core::formatted("has %g for ", q) + name + "; allowed: " + range_text(found->lower, found->upper));
    config.held[j] = q;
  }
}

}  // namespace

MappingConfig read_mapping(const Fields& section, const robot::SerialArm& arm,
                           const core::JointArray& arm_tolerance) {
  MappingConfig config;
  config.arm_tolerance = arm_tolerance;
  config.mapping.arm_joints = arm.joint_count();
  const auto master = runtime::load_kinematics(runtime::read_arm_file(section.existing_file("device")));
  section.named("joints", runtime::joint_names(arm),
                [&](const Fields& own, std::size_t j) { read_led_joint(own, arm, j, master, config); });
  section.check(
      config.mapping.master_joints > 0, "joints",
      "names none that the master leads; allowed: " + core::listed(arm.joints(), &robot::Joint::name));
  read_held(section, arm, config);
  config.device.joint_count = config.mapping.master_joints;
  for (std::size_t m = 0; m < config.mapping.master_joints; ++m) {
    const teleop::LedJoint& led = config.mapping.led[m];
    config.tolerance[m] = arm_tolerance[led.arm_joint] / std::abs(led.ratio);
  }
  return config;
}

void reflect(const MappingConfig& config, ReflectedMaster& at_arm) noexcept {
  const teleop::JointMapping mapping(config.mapping);
  for (std::size_t j = 0; j < config.mapping.arm_joints; ++j) {
    if (!mapping.leads(j)) at_arm.inertia[j] = kHeldInertia;
  }
  for (std::size_t m = 0; m < config.mapping.master_joints; ++m) {
    const auto [j, ratio, at_zero] = config.mapping.led[m];
    const double r = std::abs(ratio), squared = r * r;
    at_arm.inertia[j] = config.device.joints[m].inertia / squared;
    at_arm.viscous[j] = config.device.joints[m].viscous / squared;
    at_arm.coulomb[j] = config.device.joints[m].coulomb / r;
    at_arm.torque_limit[j] = config.device.torque_limit_Nm[m] / r;
    at_arm.torque_rate[j] = config.torque_rate[m] / r;
    at_arm.damping_cap[j] = config.damping_cap[m] / squared;
    at_arm.encoder_step[j] = config.device.encoder_resolution[m] * r;
  }
}

core::JointArray start_of(const MappingConfig& config, const core::JointArray& arm_q) noexcept {
  core::JointArray q = teleop::JointMapping(config.mapping).master_position(arm_q);
  for (std::size_t m = 0; m < config.mapping.master_joints; ++m)
    q[m] = std::clamp(q[m], config.joints[m].lower, config.joints[m].upper);
  return q;
}

}  // namespace phantom::master_io

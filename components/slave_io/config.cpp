#include "components/slave_io/config.hpp"

#include <algorithm>

#include "common/robot/kinematics/joint_values.hpp"
#include "common/runtime/configuration/drives_config.hpp"
#include "common/runtime/servo/servo_check.hpp"
#include "common/simulation/reflected_inertia.hpp"

namespace phantom::slave_io {
namespace {

using robot::by_joint_type;
using runtime::Fields;

void read_plant(const Fields& section, const robot::SerialArm& arm, const core::JointArray& home,
                simulation::SlavePlantParameters& plant) {
  section.flag("balanced", plant.balanced);
  plant.rotor = by_joint_type(arm, section.value("rotor_inertia_kg_m2"), section.value("rotor_mass_kg"));
  const double coulomb = section.value("coulomb_share_of_effort"),
               viscous = section.value("viscous_share_of_effort");
  plant.encoder_resolution =
      by_joint_type(arm, section.value("encoder_step_rad"), section.value("encoder_step_m"));
  section.number("velocity_filter_s", plant.velocity_filter_s);
  section.number("sub_steps", plant.sub_steps);
  section.number("payload_kg", plant.payload.mass_kg);
  section.vector3("payload_centre_m", plant.payload.centre_m);
  const auto inertia = simulation::reflected_inertia(arm, home, plant.rotor);
  for (std::size_t j = 0; j < arm.joint_count(); ++j) {
    const auto& joint = arm.joints()[j];
    plant.joints[j] = {.inertia = inertia[j],
                       .viscous = viscous * joint.max_effort / joint.max_speed,
                       .coulomb = coulomb * joint.max_effort,
                       .lower = joint.lower,
                       .upper = joint.upper};
  }
}

void read_servo(const Fields& section, const robot::SerialArm& arm, Config& config) {
  const double bandwidth_Hz = section.value("bandwidth_Hz"), damping = section.value("damping_ratio", 1.0),
               share = section.value("torque_share_of_effort", 1.0);
  section.flag("gravity_feed_forward", config.gravity_feed_forward);
  section.check(
      !config.gravity_feed_forward || !config.plant.balanced, "gravity_feed_forward",
      "is true, but counterweights take the weight (plant.balanced); allowed: false, or plant.balanced: false");
  for (std::size_t j = 0; j < arm.joint_count(); ++j)
    config.gains[j] = teleop::gains_for(config.plant.joints[j].inertia, bandwidth_Hz, damping,
                                        share * arm.joints()[j].max_effort);
  section.named("joints", runtime::joint_names(arm), [&](const Fields& own, std::size_t j) {
    own.number("k_p", config.gains[j].k_p);
    own.number("k_v", config.gains[j].k_v);
  });
}

// After read_alignment(), whose speeds are those at which the arm yields.
void read_contact_limit(const Fields& section, const robot::SerialArm& arm, Config& config) {
  auto& limit = config.contact_limit;
  limit.joint_count = arm.joint_count();
  limit.yield_speed = config.align_speed;
  const double share = section.value("share_of_effort", 0.0);
  section.number("tool_N", limit.tool_force_N);
  for (std::size_t j = 0; j < arm.joint_count(); ++j) limit.torque_Nm[j] = share * arm.joints()[j].max_effort;
  section.named("joints", runtime::joint_names(arm),
                [&](const Fields& own, std::size_t j) { own.number("torque", limit.torque_Nm[j]); });
}

void read_alignment(const Fields& section, const robot::SerialArm& arm, Config& config) {
  config.align_tolerance = by_joint_type(arm, section.value("tolerance_rad"), section.value("tolerance_m"));
  config.align_speed = by_joint_type(arm, section.value("speed_rad_s"), section.value("speed_m_s"));
  config.align_range = by_joint_type(arm, section.value("range_rad"), section.value("range_m"));
}

void read_contact(const Fields& section, Config& config) {
  section.number("stiffness_N_per_m", config.plant.contact_stiffness_N_per_m);
  section.number("damping_N_s_per_m", config.plant.contact_damping_Ns_per_m);
  section.number("friction", config.plant.contact_friction);
  auto& contact = config.contact;
  section.number("point_pitch_m", contact.point_pitch_m);
  section.number("max_points", contact.max_points);
  section.number("clearance_range_m", contact.clearance_range_m);
}

void read_can(const Fields& section, const robot::SerialArm& arm, Config& config) {
  core::JointArray max_torque{};
  for (std::size_t j = 0; j < arm.joint_count(); ++j) max_torque[j] = config.gains[j].torque_limit;
  config.can = runtime::read_drives(section, arm.joints(), max_torque, config.period_s,
                                    config.gripper ? &config.gripper->limits : nullptr);
  if (config.gripper) config.gripper->drive = runtime::gripper_drive(*config.can);
  for (std::size_t j = 0; j < arm.joint_count(); ++j) {
    section.check(
        config.can->group.axes[j].mode != can::DriveMode::kVelocity || config.gains[j].k_v > 0.0, "drives",
        arm.joints()[j].name + " is in mode velocity, which needs servo k_v; allowed: greater than 0");
  }
}

void read_gripper(const Fields& section, bool simulated, GripperConfig& gripper) {
  teleop::GripperLimits& limits = gripper.limits;
  section.number("widest_m", limits.widest_m);
  section.number("max_speed_m_s", limits.max_speed_m_s);
  section.number("least_force_N", limits.least_force_N);
  section.number("greatest_force_N", limits.greatest_force_N);
  section.number("force_N", limits.usual_force_N);
  section.check(limits.greatest_force_N >= limits.least_force_N, "greatest_force_N",
                "is less than least_force_N; allowed: that or more");
  section.check(
      limits.usual_force_N >= limits.least_force_N && limits.usual_force_N <= limits.greatest_force_N,
      "force_N", "is not between least_force_N and greatest_force_N; allowed: that");
  simulation::GripperPlantParameters& plant = gripper.plant;
  plant.widest_m = limits.widest_m;
  section.number("finger_mass_kg", plant.finger_mass_kg);
  section.number("friction_N", plant.coulomb_N);
  section.number("pad_friction", gripper.pad_friction);
  section.number("object_width_m", plant.object_width_m);
  section.number("object_stiffness_N_per_m", plant.object_stiffness_N_per_m);
  if (!simulated) return;
  section.check(plant.object_width_m < limits.widest_m, "object_width_m",
                "does not fit between the open fingers; allowed: less than widest_m");
  section.check(plant.coulomb_N < limits.least_force_N, "friction_N",
                "is not less than least_force_N; allowed: less");
  // Or the drive would not press with its greatest force at what is in its way.
  const double most_N =
      simulation::GripperPlant(plant, 0.0).drive_stiffness_N_per_m() * teleop::GripperControl::kLead_m;
  section.check(limits.greatest_force_N <= most_N, "greatest_force_N",
                "is more than a simulated gripper with such light fingers exerts; allowed: at most " +
                    std::to_string(most_N) + " N");
}

// The Coulomb friction of a joint rises up to this share of its greatest speed.
constexpr double kSlowShare = 0.01;
// A lag shorter than so many measurements would follow their steps.
constexpr double kMeasurementsPerLag = 2.0;

void read_force_observer(const Fields& section, const robot::SerialArm& arm, Config& config) {
  auto& observer = config.force_observer.emplace();
  section.number("lag_s", observer.lag_s);
  section.choice("model", observer.coupled, {{"arm", true}, {"joints", false}});
  section.number("unexplained_energy_share", config.unexplained_energy_share);
  observer.weight = observer.coupled && !config.plant.balanced;
  const double share = section.value("threshold_share_of_effort", 0.05);
  for (std::size_t j = 0; j < arm.joint_count(); ++j) {
    const auto& mechanics = config.plant.joints[j];
    observer.inertia_kg_m2[j] = observer.coupled ? config.plant.rotor[j] : mechanics.inertia;
    observer.coulomb_Nm[j] = mechanics.coulomb;
    observer.viscous_Nms_per_rad[j] = mechanics.viscous;
    observer.slow_rad_s[j] = kSlowShare * arm.joints()[j].max_speed;
    observer.threshold_Nm[j] = share * arm.joints()[j].max_effort;
  }
  section.named("joints", runtime::joint_names(arm), [&](const Fields& own, std::size_t j) {
    own.number("threshold", observer.threshold_Nm[j]);
    own.number("coulomb", observer.coulomb_Nm[j]);
    own.number("viscous", observer.viscous_Nms_per_rad[j]);
  });
  for (std::size_t j = 0; j < arm.joint_count(); ++j) {
    // A joint that rests may bear so much by its friction alone.
    if (observer.threshold_Nm[j] > observer.coulomb_Nm[j]) continue;
    const std::string& name = arm.joints()[j].name;
    const bool own = section.section("joints").has(name);
    throw section.error(own ? "joints" : "threshold_share_of_effort",
                        "is not above the Coulomb friction of " + name + "; allowed: more than " +
                            std::to_string(observer.coulomb_Nm[j]) + " N·m or N");
  }
  if (!config.can) return;
  const double shortest_s = kMeasurementsPerLag * config.can->group.timing.measure_every * config.period_s;
  section.check(observer.lag_s >= shortest_s * (1.0 - 1e-9), "lag_s",
                "is less than two measurements of the drives take; allowed: at least " +
                    std::to_string(shortest_s) + " s");
}

// A torque takes effect one SYNC after it was sent and acts half a period later on average. The position that
// it answers is one SYNC old.
constexpr double kDelayOnCan_periods = 2.5;
constexpr double kDelaySimulated_periods = 0.5;

// Sets what the joints bear while the loop is held up; simulated ones wait for it. A tick that is late by
// half a period costs nothing.
void set_held(const robot::SerialArm& arm, Config& config) {
  if (config.driver != Driver::kCan) return;
  for (std::size_t j = 0; j < arm.joint_count(); ++j) {
    if (config.can->group.axes[j].mode == can::DriveMode::kPosition) continue;
    config.held[j] = teleop::held_torque(config.gains[j], config.plant.joints[j].inertia,
                                         arm.joints()[j].max_speed, kDelayOnCan_periods);
    config.held[j].longest_s = std::max(config.held[j].longest_s, teleop::kPunctual * config.period_s);
  }
}

// Checks that the position loops computed here are stable with the delay at their rate.
void check_loops(const Fields& servo, const robot::SerialArm& arm, const Config& config) {
  const bool on_can = config.driver == Driver::kCan;
  const double delay_periods = on_can ? kDelayOnCan_periods : kDelaySimulated_periods;
  for (std::size_t j = 0; j < arm.joint_count(); ++j) {
    if (on_can && config.can->group.axes[j].mode != can::DriveMode::kTorque) continue;
    const std::string why = runtime::oscillation_reason(config.gains[j], config.plant.joints[j].inertia,
                                                        config.period_s, delay_periods);
    if (why.empty()) continue;
    const std::string& name = arm.joints()[j].name;
    const bool own = servo.section("joints").has(name);
    throw servo.error(own ? "joints" : "bandwidth_Hz", "makes " + name + " " + why);
  }
}

}  // namespace

double force_lag_s(const Config& config) {
  return config.force_observer.value().lag_s +
         config.can.value().group.timing.measure_every * config.period_s;
}

Config load_config(const std::filesystem::path& path, const robot::SerialArm& arm,
                   const core::JointArray& home) {
  const Fields file(path, {kParameters, runtime::kDriveParameters, runtime::kSwitchParameters});
  Config config;
  file.choice("driver", config.driver, {{"sim", Driver::kSimulated}, {"can", Driver::kCan}});
  config.period_s = runtime::read_servo_loop(file, config.scheduling, config.measure_bare_loop);
  file.flag("force_sensor", config.force_sensor);
  file.number("max_payload_kg", config.max_payload_kg);
  runtime::read_link(file.section("link"), config.link);
  runtime::read_loop_guard(file.section("loop"), config.period_s, config.loop);
  read_plant(file.section("plant"), arm, home, config.plant);
  const Fields servo = file.section("servo");
  read_servo(servo, arm, config);
  read_alignment(file.section("alignment"), arm, config);
  read_contact_limit(file.section("contact_limit"), arm, config);
  if (config.driver == Driver::kSimulated || file.has("contact"))
    read_contact(file.section("contact"), config);
  if (file.has("gripper"))
    read_gripper(file.section("gripper"), config.driver == Driver::kSimulated, config.gripper.emplace());
  if (config.driver == Driver::kCan || file.has("can")) read_can(file.section("can"), arm, config);
  config.enabling_switch = runtime::read_enabling_switch(file, config.can);
  if (file.has("force_observer")) read_force_observer(file.section("force_observer"), arm, config);
  if (file.has("force_torque_sensor"))
    config.wrist =
        read_wrist_sensor(file.section("force_torque_sensor"), arm, config.can ? &*config.can : nullptr);
  file.check(
      !config.force_sensor || config.driver == Driver::kSimulated || config.force_observer || config.wrist,
      "force_sensor",
      "has nothing behind it with drives on CAN; allowed: false, or true with a section "
      "force_torque_sensor or force_observer");
  check_loops(servo, arm, config);
  set_held(arm, config);
  file.finish();
  return config;
}

}  // namespace phantom::slave_io

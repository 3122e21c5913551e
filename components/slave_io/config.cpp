#include "components/slave_io/config.hpp"

#include <algorithm>

#include "common/robot/joint_values.hpp"
#include "common/runtime/drives_config.hpp"
#include "common/runtime/servo_check.hpp"

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
  const auto inertia = simulation::reflected_inertia(arm, home, *plant.rotor);
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
  for (std::size_t j = 0; j < arm.joint_count(); ++j)
    config.gains[j] = teleop::gains_for(config.plant.joints[j].inertia, bandwidth_Hz, damping,
                                        share * arm.joints()[j].max_effort);
  section.named("joints", runtime::joint_names(arm), [&](const Fields& own, std::size_t j) {
    own.number("k_p", config.gains[j].k_p);
    own.number("k_v", config.gains[j].k_v);
  });
}

void read_alignment(const Fields& section, const robot::SerialArm& arm, Config& config) {
  config.align_tolerance = by_joint_type(arm, section.value("tolerance_rad"), section.value("tolerance_m"));
  config.align_speed = by_joint_type(arm, section.value("speed_rad_s"), section.value("speed_m_s"));
  config.align_range = by_joint_type(arm, section.value("range_rad"), section.value("range_m"));
}

void read_contact(const Fields& section, Config& config) {
  section.number("stiffness_N_per_m", config.plant.contact_stiffness_N_per_m);
  section.number("damping_N_s_per_m", config.plant.contact_damping_Ns_per_m);
  auto& contact = config.contact;
  section.number("point_pitch_m", contact.point_pitch_m);
  section.number("max_points", contact.max_points);
  section.number("touch_voxel_m", contact.touch_voxel_m);
  section.number("clearance_voxel_m", contact.clearance_voxel_m);
  section.number("clearance_range_m", contact.clearance_range_m);
  section.check(contact.clearance_range_m <= 64 * contact.clearance_voxel_m, "clearance_range_m",
                "is wider than 64 voxels of the distance field; allowed: at most " +
                    std::to_string(64 * contact.clearance_voxel_m) + " m");
}

void read_can(const Fields& section, const robot::SerialArm& arm, Config& config) {
  core::JointArray max_torque{};
  for (std::size_t j = 0; j < arm.joint_count(); ++j) max_torque[j] = config.gains[j].torque_limit;
  config.can = runtime::read_drives(section, arm, max_torque, config.period_s);
  for (std::size_t j = 0; j < arm.joint_count(); ++j) {
    section.check(
        config.can->group.axes[j].mode != can::DriveMode::kVelocity || config.gains[j].k_v > 0.0, "drives",
        arm.joints()[j].name + " is in mode velocity, which needs servo k_v; allowed: greater than 0");
  }
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

Config load_config(const std::filesystem::path& path, const robot::SerialArm& arm,
                   const core::JointArray& home) {
  const Fields file(path, {kParameters, runtime::kDriveParameters});
  Config config;
  file.choice("driver", config.driver, {{"sim", Driver::kSimulated}, {"can", Driver::kCan}});
  config.period_s = runtime::read_servo_loop(file, config.scheduling, config.measure_bare_loop);
  file.flag("force_sensor", config.force_sensor);
  runtime::read_link(file.section("link"), config.link);
  runtime::read_loop_guard(file.section("loop"), config.period_s, config.loop);
  read_plant(file.section("plant"), arm, home, config.plant);
  const Fields servo = file.section("servo");
  read_servo(servo, arm, config);
  read_alignment(file.section("alignment"), arm, config);
  if (config.driver == Driver::kSimulated || file.has("contact"))
    read_contact(file.section("contact"), config);
  if (config.driver == Driver::kCan || file.has("can")) read_can(file.section("can"), arm, config);
  check_loops(servo, arm, config);
  set_held(arm, config);
  file.finish();
  return config;
}

}  // namespace phantom::slave_io

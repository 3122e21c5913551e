#include "components/slave_io/config.hpp"

#include <algorithm>

#include "common/robot/joint_values.hpp"
#include "common/runtime/config_reader.hpp"
#include "common/runtime/link_config.hpp"
#include "common/runtime/servo_check.hpp"

namespace phantom::slave_io {
namespace {

using runtime::ConfigReader;

void read_plant(const ConfigReader& section, const robot::SerialArm& arm, const core::JointArray& home,
                teleop::SlavePlantParameters& plant) {
  plant.balanced = section.flag("balanced", true);
  const auto rotor = robot::by_joint_type(arm, section.number("rotor_inertia_kg_m2", {1e-4, 1e4, "kg·m²"}),
                                          section.number("rotor_mass_kg", {1e-3, 1e5, "kg"}));
  plant.rotor = rotor;
  const auto inertia = teleop::reflected_inertia(arm, home, rotor);
  const double coulomb = section.number("coulomb_share_of_effort", {0, 1, ""});
  const double viscous = section.number("viscous_share_of_effort", {0, 10, ""});
  plant.encoder_resolution = robot::by_joint_type(arm, section.number("encoder_step_rad", {1e-9, 0.1, "rad"}),
                                                  section.number("encoder_step_m", {1e-9, 0.1, "m"}));
  plant.velocity_filter_s = section.number("velocity_filter_s", 0.002, {0, 0.1, "s"});
  plant.sub_steps = section.integer("sub_steps", 4, {1, 100, ""});
  for (std::size_t j = 0; j < arm.joint_count(); ++j) {
    const auto& joint = arm.joints()[j];
    plant.joints[j] = {.inertia = inertia[j],
                       .viscous = viscous * joint.max_effort / joint.max_speed,
                       .coulomb = coulomb * joint.max_effort,
                       .lower = joint.lower,
                       .upper = joint.upper};
  }
}

void read_servo(const ConfigReader& section, const robot::SerialArm& arm, Config& config) {
  const double bandwidth_Hz = section.number("bandwidth_Hz", {0.1, 100, "Hz"});
  const double damping = section.number("damping_ratio", 1.0, {0.1, 10, ""});
  const double share = section.number("torque_share_of_effort", 1.0, {0.01, 1, ""});
  config.gravity_feed_forward = section.flag("gravity_feed_forward", false);
  const ConfigReader single = section.optional_section("joints");
  for (std::size_t j = 0; j < arm.joint_count(); ++j) {
    const auto& joint = arm.joints()[j];
    config.gains[j] =
        teleop::gains_for(config.plant.joints[j].inertia, bandwidth_Hz, damping, share * joint.max_effort);
    if (!single.has(joint.name)) continue;
    const ConfigReader own = single.section(joint.name);
    config.gains[j].k_p = own.number("k_p", {0, 1e7, "N·m/rad or N/m"});
    config.gains[j].k_v = own.number("k_v", {0, 1e6, "N·m·s/rad or N·s/m"});
  }
}

void read_alignment(const ConfigReader& section, const robot::SerialArm& arm, Config& config) {
  config.align_tolerance = robot::by_joint_type(arm, section.number("tolerance_rad", {1e-6, 1, "rad"}),
                                                section.number("tolerance_m", {1e-6, 1, "m"}));
  config.align_speed = robot::by_joint_type(arm, section.number("speed_rad_s", {1e-4, 10, "rad/s"}),
                                            section.number("speed_m_s", {1e-4, 10, "m/s"}));
  config.align_range = robot::by_joint_type(arm, section.number("range_rad", {0, 10, "rad"}),
                                            section.number("range_m", {0, 10, "m"}));
}

void read_contact(const ConfigReader& section, Config& config) {
  config.plant.contact_stiffness_N_per_m = section.number("stiffness_N_per_m", {1, 1e6, "N/m"});
  config.plant.contact_damping_Ns_per_m = section.number("damping_N_s_per_m", {0, 1e4, "N·s/m"});
  auto& contact = config.contact;
  contact.point_pitch_m = section.number("point_pitch_m", contact.point_pitch_m, {0.001, 1, "m"});
  contact.max_points = section.integer("max_points", contact.max_points, {10, 20000, "points"});
  contact.touch_voxel_m = section.number("touch_voxel_m", contact.touch_voxel_m, {0.0005, 0.1, "m"});
  contact.clearance_voxel_m =
      section.number("clearance_voxel_m", contact.clearance_voxel_m, {0.0005, 0.2, "m"});
  contact.clearance_range_m = section.number("clearance_range_m", contact.clearance_range_m, {0.01, 2, "m"});
  if (contact.clearance_range_m > 64 * contact.clearance_voxel_m) {
    throw section.error("clearance_range_m",
                        "is wider than 64 voxels of the distance field; allowed: at most " +
                            std::to_string(64 * contact.clearance_voxel_m) + " m");
  }
}

void read_can(const ConfigReader& section, const robot::SerialArm& arm, Config& config) {
  core::JointArray max_torque{};
  for (std::size_t j = 0; j < arm.joint_count(); ++j) max_torque[j] = config.gains[j].torque_limit;
  config.can = runtime::read_drives(section, arm, max_torque, config.period_s);
  for (std::size_t j = 0; j < arm.joint_count(); ++j) {
    if (config.can->group.axes[j].mode == can::DriveMode::kVelocity && config.gains[j].k_v <= 0.0)
      throw section.error(
          "drives",
          arm.joints()[j].name + " is in mode velocity, which needs servo k_v; allowed: greater than 0");
  }
}

// A torque acts a SYNC after it was sent, and half a period later on average; what it answers is a SYNC
// older.
constexpr double kDelayOnCan_periods = 2.5;
constexpr double kDelaySimulated_periods = 0.5;

// Whether the position loops that run here bear the delay that their rate brings.
void check_loops(const ConfigReader& servo, const robot::SerialArm& arm, const Config& config) {
  const bool on_can = config.driver == Driver::kCan;
  const double delay_periods = on_can ? kDelayOnCan_periods : kDelaySimulated_periods;
  for (std::size_t j = 0; j < arm.joint_count(); ++j) {
    if (on_can && config.can->group.axes[j].mode != can::DriveMode::kTorque) continue;
    const std::string why = runtime::why_it_swings(config.gains[j], config.plant.joints[j].inertia,
                                                   config.period_s, delay_periods);
    if (why.empty()) continue;
    const std::string& name = arm.joints()[j].name;
    const bool own = servo.optional_section("joints").has(name);
    throw servo.error(own ? "joints" : "bandwidth_Hz", "makes " + name + " " + why);
  }
}

}  // namespace

std::string arm_name(const std::filesystem::path& file) {
  return ConfigReader::from_file(file).text("arm", "");
}

Config load_config(const std::filesystem::path& path, const robot::SerialArm& arm,
                   const core::JointArray& home) {
  const ConfigReader file = ConfigReader::from_file(path);
  Config config;
  config.driver = file.choice("driver", "sim", {"sim", "can"}) == "can" ? Driver::kCan : Driver::kSimulated;
  file.text("arm", "");
  config.period_s = 1.0 / file.number("rate_Hz", 1000, {50, 5000, "Hz"});
  config.scheduling.servo_priority = file.integer("fifo_priority", 0, {0, 99, ""});
  config.scheduling.lock_memory = file.flag("lock_memory", false);
  config.measure_bare_loop = file.flag("measure_bare_loop", false);
  config.force_sensor = file.flag("force_sensor", false);
  config.link = runtime::read_link(file.optional_section("link"));
  read_plant(file.section("plant"), arm, home, config.plant);
  const ConfigReader servo = file.section("servo");
  read_servo(servo, arm, config);
  read_alignment(file.section("alignment"), arm, config);
  if (config.driver == Driver::kSimulated || file.has("contact"))
    read_contact(file.section("contact"), config);
  if (config.driver == Driver::kCan || file.has("can")) read_can(file.section("can"), arm, config);
  check_loops(servo, arm, config);
  file.finish();
  return config;
}

}  // namespace phantom::slave_io

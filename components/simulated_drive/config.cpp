#include "components/simulated_drive/config.hpp"

#include <algorithm>
#include <cmath>

#include "common/runtime/configuration/fields.hpp"

namespace phantom::simulated_drive {
namespace {

constexpr double kMinLever_m = 0.001;

void read_drive(const runtime::Fields& drive, DriveOptions& options) {
  MotorParameters& motor = options.motor;
  drive.number("node", options.node);
  drive.number("counts_per_turn", motor.counts_per_turn);
  drive.number("gear_ratio", motor.gear_ratio);
  drive.number("rated_torque_Nm", motor.rated_torque_Nm);
  drive.number("peak_share", motor.peak_share);
  drive.number("inertia_kg_m2", motor.joint.inertia);
  drive.number("viscous_Nms_per_rad", motor.joint.viscous);
  drive.number("coulomb_Nm", motor.joint.coulomb);
  drive.number("load_Nm", motor.load_Nm);
  if (drive.has("hand")) {
    const runtime::Fields hand = drive.section("hand");
    hand.number("swing_rad", motor.hand.swing_rad);
    hand.number("period_s", motor.hand.period_s);
    hand.number("stiffness_Nm_per_rad", motor.hand.stiffness_Nm_per_rad);
    hand.number("damping_Nms_per_rad", motor.hand.damping_Nms_per_rad);
  }
  if (drive.has("brake")) {
    const runtime::Fields brake = drive.section("brake");
    brake.number("holds_Nm", motor.brake.holds_Nm);
    brake.number("release_s", motor.brake.release_s);
    brake.number("engage_s", motor.brake.engage_s);
  }
  drive.number("start_rad", motor.start_rad);
  if (drive.has("wall")) {
    const runtime::Fields wall = drive.section("wall");
    wall.number("at_rad", motor.wall.at_rad);
    wall.number("stiffness_Nm_per_rad", motor.wall.stiffness_Nm_per_rad);
    wall.number("damping_Nms_per_rad", motor.wall.damping_Nms_per_rad);
    wall.check(motor.wall.at_rad != motor.start_rad, "at_rad", "is start_rad; allowed: a place beside it");
    // The joint moves in steps: a stiffer wall would throw it back farther at each of them.
    const double stiffest = motor.joint.inertia / (kSubStep_s * kSubStep_s);
    wall.check(motor.wall.stiffness_Nm_per_rad <= stiffest, "stiffness_Nm_per_rad",
               "is too much for the joint's inertia; allowed: up to " + std::to_string(stiffest));
    const double thickest = motor.joint.inertia / kSubStep_s;
    wall.check(motor.wall.damping_Nms_per_rad <= thickest, "damping_Nms_per_rad",
               "is too much for the joint's inertia; allowed: up to " + std::to_string(thickest));
  }
  drive.number("lower_stop_rad", motor.joint.lower);
  drive.number("upper_stop_rad", motor.joint.upper);
  drive.check(motor.joint.lower <= motor.start_rad, "lower_stop_rad",
              "is above start_rad; allowed: that or less");
  drive.check(motor.joint.upper >= motor.start_rad, "upper_stop_rad",
              "is below start_rad; allowed: that or more");
  drive.choice("encoder", options.incremental, {{"absolute", false}, {"incremental", true}});
  const double counts_per_rad = motor.counts_per_rad();
  drive.number("lower_switch_rad", options.switches.lower_limit, counts_per_rad);
  drive.number("upper_switch_rad", options.switches.upper_limit, counts_per_rad);
  drive.number("home_from_rad", options.switches.home_from, counts_per_rad);
  drive.number("home_to_rad", options.switches.home_to, counts_per_rad);
  drive.number("index_rad", options.switches.index, counts_per_rad);
  drive.number("following_window_rad", options.following_window_rad);
  drive.number("quick_stop_rad_s2", options.quick_stop_rad_s2);
  drive.flag("keeps_max_speed", options.keeps_max_speed);
  std::vector<int> bits;
  drive.numbers("enabling_bits", bits);
  for (const int bit : bits) options.enabling_inputs |= 1U << static_cast<unsigned>(bit);
}

void read_force_sensor(const runtime::Fields& section, const Config& config, ForceSensorOptions& sensor) {
  section.number("node", sensor.node);
  section.check(std::ranges::find(config.drives, sensor.node, &DriveOptions::node) != config.drives.end(),
                "node", "is none of the drives; allowed: one of theirs");
  section.number("rate_Hz", sensor.rate_Hz);
  section.number("id", sensor.id);
  section.number("count_N", sensor.count_N);
  section.number("count_Nm", sensor.count_Nm);
  section.vector3("axis", sensor.axis);
  section.vector3("axis_at_m", sensor.axis_at_m);
  section.vector3("touches_at_m", sensor.touches_at_m);
  section.vector3("normal", sensor.normal);
  section.check(sensor.axis.norm() > 0.0 && sensor.normal.norm() > 0.0, "axis",
                "or normal has no direction; allowed: vectors other than 0");
  sensor.axis.normalize();
  sensor.normal.normalize();
  section.check(std::abs(sensor.lever_m()) >= kMinLever_m, "normal",
                "acts nearly through the joint's axis; allowed: a lever of at least 0.001 m");
  section.vector3("weight_N", sensor.weight_N);
  section.vector3("weight_at_m", sensor.weight_at_m);
  section.number("noise_N", sensor.noise_N);
  section.number("noise_Nm", sensor.noise_Nm);
  section.number("offset_N", sensor.offset_N);
  section.number("offset_Nm", sensor.offset_Nm);
  section.number("drift_N_per_s", sensor.drift_N_per_s);
  section.number("drift_Nm_per_s", sensor.drift_Nm_per_s);
}

}  // namespace

Config load_config(const std::filesystem::path& path) {
  const runtime::Fields file(path, {kParameters});
  Config config;
  file.text("bus", config.bus);
  file.number("bit_rate", config.bit_rate);
  for (const runtime::Fields& section : file.sections("drives")) {
    DriveOptions drive;
    read_drive(section, drive);
    section.check(std::ranges::find(config.drives, drive.node, &DriveOptions::node) == config.drives.end(),
                  "node", "is used twice; allowed: each node id once");
    config.drives.push_back(drive);
  }
  file.check(!config.drives.empty(), "drives", "names no drive; allowed: at least one");
  if (file.has("force_torque_sensor"))
    read_force_sensor(file.section("force_torque_sensor"), config, config.force_sensor.emplace());
  file.finish();
  return config;
}

}  // namespace phantom::simulated_drive

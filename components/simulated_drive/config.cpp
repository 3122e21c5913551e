#include "components/simulated_drive/config.hpp"

#include <set>

#include "common/runtime/config_reader.hpp"

namespace phantom::simulated_drive {

using runtime::ConfigReader;

namespace {

DriveOptions read_drive(const ConfigReader& section) {
  DriveOptions drive;
  MotorParameters& motor = drive.motor;
  drive.node = section.integer("node", {1, 127, ""});
  motor.counts_per_turn = section.number("counts_per_turn", motor.counts_per_turn, {4, 1e8, "counts"});
  motor.gear_ratio = section.number("gear_ratio", motor.gear_ratio, {0.01, 1e4, ""});
  motor.rated_torque_Nm = section.number("rated_torque_Nm", motor.rated_torque_Nm, {1e-3, 1e4, "N·m"});
  motor.peak_share = section.number("peak_share", motor.peak_share, {0.1, 10, ""});
  motor.load_Nm = section.number("load_Nm", motor.load_Nm, {-1e4, 1e4, "N·m"});
  if (section.has("hand")) {
    const ConfigReader hand = section.section("hand");
    motor.hand.swing_rad = hand.number("swing_rad", {0, 10, "rad"});
    motor.hand.period_s = hand.number("period_s", motor.hand.period_s, {0.1, 1e3, "s"});
    motor.hand.stiffness_Nm_per_rad =
        hand.number("stiffness_Nm_per_rad", motor.hand.stiffness_Nm_per_rad, {0, 1e5, "N·m/rad"});
    motor.hand.damping_Nms_per_rad =
        hand.number("damping_Nms_per_rad", motor.hand.damping_Nms_per_rad, {0, 1e4, "N·m·s/rad"});
  }
  motor.joint.inertia = section.number("inertia_kg_m2", motor.joint.inertia, {1e-5, 1e4, "kg·m²"});
  motor.joint.viscous = section.number("viscous_Nms_per_rad", motor.joint.viscous, {0, 1e4, "N·m·s/rad"});
  motor.joint.coulomb = section.number("coulomb_Nm", motor.joint.coulomb, {0, 1e4, "N·m"});
  motor.start_rad = section.number("start_rad", 0.0, {-1e3, 1e3, "rad"});
  motor.joint.lower = section.number("lower_stop_rad", motor.joint.lower, {-1e6, motor.start_rad, "rad"});
  motor.joint.upper = section.number("upper_stop_rad", motor.joint.upper, {motor.start_rad, 1e6, "rad"});
  drive.following_window_rad =
      section.number("following_window_rad", drive.following_window_rad, {1e-4, 100, "rad"});
  drive.quick_stop_rad_s2 =
      section.number("quick_stop_rad_s2", drive.quick_stop_rad_s2, {0.01, 1e5, "rad/s²"});
  return drive;
}

}  // namespace

Config load_config(const std::filesystem::path& path) {
  const ConfigReader file = ConfigReader::from_file(path);
  Config config;
  config.bus = file.text("bus");
  config.bit_rate = file.number("bit_rate", config.bit_rate, {0, 1e6, "bit/s; 0: frames take no time"});
  std::set<int> nodes;
  for (const ConfigReader& section : file.sections("drives")) {
    config.drives.push_back(read_drive(section));
    if (!nodes.insert(config.drives.back().node).second)
      throw section.error("node", "is used twice; allowed: each node id once");
  }
  if (config.drives.empty()) throw file.error("drives", "names no drive; allowed: at least one");
  file.finish();
  return config;
}

}  // namespace phantom::simulated_drive

#pragma once

#include <string>

#include "components/slave_io/tests/fixture.hpp"

namespace phantom::slave_io {

/// A sensor behind the tool's joint, as it would stand in slave_io.yaml; its frames are a pair on bus b.
inline const std::string kWristSection = R"(
force_torque_sensor:
  source: can
  link: gripper
  pose: {xyz_m: [0, 0, -0.03], rpy_deg: [0, 0, 30]}
  rate_Hz: 500
  staleness_s: 0.02
  sensor_lag_s: 0.001
  filter_s: 0.002
  rated_N: [200, 200, 400]
  rated_Nm: [20, 20, 20]
  threshold_N: 4
  threshold_Nm: 0.4
  payload_kg: 1.2
  payload_centre_m: [0.01, 0, -0.05]
  tare: {most_N: 20, most_Nm: 2, time_s: 0.3}
  can:
    address: "user:hot_cell_b"
    byte_order: little
    number: signed
    bytes: 2
    channels:
      force_x: {id: 416, byte: 0, scale: 0.02}
      force_y: {id: 416, byte: 2, scale: 0.02}
      force_z: {id: 416, byte: 4, scale: 0.02}
      torque_x: {id: 417, byte: 0, scale: 0.001}
      torque_y: {id: 417, byte: 2, scale: 0.001}
      torque_z: {id: 417, byte: 4, scale: 0.001}
    status:
      - {id: 416, byte: 6, mask: 129, good: 128}
link:)";

/// The shipped file for drives with that section, with one piece of its text replaced.
inline std::filesystem::path wrist_file(const std::string& from = "", const std::string& to = "") {
  return changed("\nlink:", from.empty() ? kWristSection : test::replaced(kWristSection, from, to), kCanFile);
}

inline WristSensorConfig wrist_config(const std::string& from = "", const std::string& to = "") {
  return load_config(wrist_file(from, to), shipped_arm().arm, shipped_arm().home).wrist.value();
}

}  // namespace phantom::slave_io

#pragma once

// Exports recordings in ROS 2's words. Part of the DDS adapter.

#include <iosfwd>

#include "common/robot/kinematics/serial_arm.hpp"
#include "common/ros2/from_phantom.hpp"
#include "components/dds_recorder/files.hpp"

namespace phantom::dds_recorder {

/// The arguments of `dds_recorder export --ros2`, which makes a bag of ROS 2 of a recording.
struct ExportRequest {
  std::vector<std::filesystem::path> files;
  std::filesystem::path out;  ///< .mcap
  TimeRange range;
  ros2::Names names;
  std::string arm;       ///< of the cell; empty: the only one
  double rate_Hz = 0.0;  ///< of each topic of states and percepts at most; 0: every sample
  int zstd_level = 3;    ///< 0: no compression
};

/// Writes the bag, under a temporary name until it is complete: what ros2_gateway says of the arm, made of
/// every sample that was recorded, at its log time and stamped with the time it was sent; and messages of
/// ROS 2 that were recorded in a ROS 2 domain, as they are. Prints on `notes` what was left out and why.
/// `urdf`: text of the arm's description; empty: none is written. Throws as run_convert(). Returns the exit
/// code.
int run_export(const ExportRequest& request, const robot::SerialArm& arm, const std::string& urdf,
               std::ostream& notes);

}  // namespace phantom::dds_recorder

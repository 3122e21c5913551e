#pragma once

#include <string>
#include <vector>

#include "components/simulated_drive/simulated_drive.hpp"

namespace phantom::simulated_drive {

/// A fault that occurs some time after the start, at one drive or at all drives.
struct TimedFault {
  std::string kind;
  double at_s = 0.0;
  int node = 0;  ///< 0: all
  bool done = false;
};

/// Returns the kinds of faults with their effects, for --help.
std::string fault_help();
/// Reads KIND@SECONDS or KIND@SECONDS:NODE. Throws ConfigError.
TimedFault parse_fault(const std::string& text);
/// Applies the fault to the drive.
void apply(const std::string& kind, SimulatedDrive& drive);

}  // namespace phantom::simulated_drive

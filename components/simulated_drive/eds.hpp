#pragma once

#include <string>

#include "components/simulated_drive/simulated_drive.hpp"

namespace phantom::simulated_drive {

/// Returns the electronic data sheet (CiA 306) of a drive with `options`, generated from its object
/// dictionary, for CANopen tools. Values that depend on the node id are given relative to $NODEID.
std::string eds_text(const DriveOptions& options);

}  // namespace phantom::simulated_drive

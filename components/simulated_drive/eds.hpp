#pragma once

#include <string>

#include "components/simulated_drive/simulated_drive.hpp"

namespace phantom::simulated_drive {

/// The electronic data sheet (CiA 306) of a drive with `options`, made from its object dictionary: what
/// CANopen tools configure it by. Values that go with the node id are told relative to $NODEID.
std::string eds_text(const DriveOptions& options);

}  // namespace phantom::simulated_drive

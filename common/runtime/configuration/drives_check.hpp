#pragma once

#include <string>

#include "common/runtime/configuration/drives_config.hpp"

namespace phantom::runtime {

/// Opens the buses of --check and asks each drive who it is (CiA 301: device type 0x1000, identity 0x1018).
/// It only reads: no drive changes its state. A bus on which a master is heard (SYNC, or its heartbeat) is
/// not asked, because that master may be asking; a userspace bus that nobody serves is said not to be there.
/// Returns what was found, a line for each bus and drive, to be said after "configuration is valid". Throws
/// MissingError for a SocketCAN interface that is missing or down, and for a drive that does not answer;
/// ConfigError for a node that is no CiA 402 drive. Takes as long as the slowest answer, for each drive.
std::string check_drives(const DrivesConfig& config);

}  // namespace phantom::runtime

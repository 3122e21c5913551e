#pragma once

#include <filesystem>
#include <string>

namespace phantom::dds {

/// Loads a file of QoS profiles into Fast DDS, once for each process and file. Throws DdsError naming the
/// file, MissingError if it is not there. Private to common/dds.
void load_profiles(const std::filesystem::path& file);

/// Returns the text of profiles with the names of elements that the present version of Fast DDS reads.
/// Version 3 renamed six of version 2 (heartbeatPeriod became heartbeat_period); a file may have either.
std::string with_names_of_this_version(std::string profiles);

}  // namespace phantom::dds

#pragma once

#include <filesystem>
#include <string>

namespace phantom::dds {

/// The profiles that the IDL's contract asks for: a data_writer and a data_reader named as each topic.
std::string default_profiles();

/// Returns the default profiles with what a site's file says in their place, element by element. `overrides`:
/// the file's text; its profiles are named as topics. `place`: the file's name. Throws DdsError with file and
/// line.
std::string overridden_profiles(const std::string& place, const std::string& overrides);

/// Loads the default profiles into Fast DDS, overridden by a site's file; once for each process. Throws
/// DdsError naming the file, MissingError if it is not there. Private to common/dds.
void load_profiles(const std::filesystem::path& file);

/// Returns the text of profiles with the names of elements that the present version of Fast DDS reads.
/// Version 3 renamed six of version 2 (heartbeatPeriod became heartbeat_period); a file may have either.
std::string with_names_of_this_version(std::string profiles);

}  // namespace phantom::dds

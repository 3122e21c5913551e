#pragma once

#include <string>

namespace phantom::dds_recorder {

/// How the type is described for those who read a recording without this project: MCAP's name of the
/// language.
inline constexpr const char* kIdlEncoding = "omgidl";

/// The project's IDL that defines the type ("phantom::msg::Percept") with everything that it refers to, as
/// one text without preprocessor lines, comments and units included; empty for a type that is not the
/// project's.
std::string idl_of(const std::string& type_name);

}  // namespace phantom::dds_recorder

#pragma once

#include <string>

namespace phantom::dds_recorder {

/// MCAP's name of the language in which types are described, for readers of a recording that do not have this
/// project.
inline constexpr const char* kIdlEncoding = "omgidl";

/// Returns the project's IDL that defines the type ("phantom::msg::Percept") with everything that it refers
/// to: one text without preprocessor lines, with comments and units. Empty for a type that is not the
/// project's.
std::string idl_of(const std::string& type_name);

}  // namespace phantom::dds_recorder

#pragma once

#include <string>

#include "common/diagnostics/type.hpp"

namespace phantom::observation {

/// The description of a type of the project's IDL by the name that topics announce, "phantom::msg::Percept";
/// null for a type that is not the project's. Made at the first call, kept for the life of the process.
/// Thread-safe.
diagnostics::TypePtr type_of(const std::string& type_name);

}  // namespace phantom::observation

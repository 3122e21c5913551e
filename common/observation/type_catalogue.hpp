#pragma once

#include <string>

#include "common/diagnostics/type.hpp"

namespace phantom::observation {

/// Returns the description of a type of the project's IDL by the name that topics announce,
/// "phantom::msg::Percept"; null for any other type. The first call creates a description, which is kept for
/// the life of the process. Thread-safe.
diagnostics::TypePtr type_of(const std::string& type_name);

}  // namespace phantom::observation

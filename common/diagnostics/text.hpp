#pragma once

#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <string>

namespace phantom::diagnostics {

/// Returns a decoded sample for a person, in a format like YAML: one member per line, small structs and lists
/// of numbers on one line, four or more equal neighbours of a list as "0 (×9)", numbers to nine digits. Ends
/// with a line feed. `indent` is in columns.
std::string to_text(const nlohmann::ordered_json& sample, std::size_t indent = 0);

/// Returns one line of JSON; text that is not UTF-8 has each offending octet as U+FFFD.
std::string to_line(const nlohmann::ordered_json& json);

}  // namespace phantom::diagnostics

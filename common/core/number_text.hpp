#pragma once

#include <optional>
#include <string_view>

namespace phantom::core {

/// Returns the number that a whole text is, as C programs write it, also with a plus sign; nothing: it is
/// none. One that is too large for a double is infinite, one that is too small is 0. Independent of the
/// locale.
std::optional<double> number_of(std::string_view text);

}  // namespace phantom::core

#pragma once

#include <cstdlib>
#include <string_view>

namespace phantom::test {

/// Returns whether dear tests take their long form: PHANTOM_THOROUGH=1. The quick one has the same assertions
/// over fewer seeds, states or samples.
inline bool thorough() {
  static const bool wanted = [] {
    const char* given = std::getenv("PHANTOM_THOROUGH");
    return given != nullptr && std::string_view(given) == "1";
  }();
  return wanted;
}

/// Returns `in_full` in the long form, else `quick`.
template <class Value>
Value thorough_or(Value quick, Value in_full) {
  return thorough() ? in_full : quick;
}

}  // namespace phantom::test

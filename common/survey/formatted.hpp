#pragma once

// Private to this library: formats numbers for messages.

#include <cstdio>
#include <string>

namespace phantom::survey::detail {

template <class Number, class... Numbers>
std::string formatted(const char* format, Number first, Numbers... others) {
  char text[256];
  std::snprintf(text, sizeof text, format, first, others...);
  return text;
}

}  // namespace phantom::survey::detail

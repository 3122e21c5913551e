#pragma once

// Private to this library: formats numbers for messages.

#include <cstdio>
#include <string>

namespace phantom::survey::detail {

template <class... Numbers>
std::string formatted(const char* format, Numbers... numbers) {
  char text[256];
  std::snprintf(text, sizeof text, format, numbers...);
  return text;
}

}  // namespace phantom::survey::detail

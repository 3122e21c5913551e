#include "common/core/text.hpp"

#include <cstdarg>
#include <cstdio>

namespace phantom::core {

std::string formatted(const char* format, ...) {
  std::va_list values, again;
  va_start(values, format);
  va_copy(again, values);
  std::string text(static_cast<std::size_t>(std::vsnprintf(nullptr, 0, format, values)), '\0');
  std::vsnprintf(text.data(), text.size() + 1, format, again);
  va_end(again);
  va_end(values);
  return text;
}

std::string_view trimmed(std::string_view text) {
  constexpr const char* kBlank = " \t\n\v\f\r";
  const std::size_t from = text.find_first_not_of(kBlank), to = text.find_last_not_of(kBlank);
  return from == std::string_view::npos ? std::string_view() : text.substr(from, to - from + 1);
}

std::string lower_case(std::string_view text) {
  std::string lower(text);
  for (char& c : lower) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return lower;
}

std::vector<std::string> cells_of(std::string_view line) {
  std::vector<std::string> cells;
  for (std::size_t from = 0, to = 0; to != std::string_view::npos; from = to + 1) {
    to = line.find(',', from);
    cells.emplace_back(trimmed(line.substr(from, to - from)));
  }
  return cells;
}

void add_to_list(std::string& list, std::string_view item) {
  if (!list.empty()) list += ", ";
  list += item;
}

}  // namespace phantom::core

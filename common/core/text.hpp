#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace phantom::core {

/// Returns text as printf would print it; the compiler holds the values against the format. Allocates.
[[gnu::format(printf, 1, 2)]] std::string formatted(const char* format, ...);

/// Returns a text without blanks, tabs and ends of lines around it; of the same memory.
std::string_view trimmed(std::string_view text);

/// Returns a text with A to Z in lower case.
std::string lower_case(std::string_view text);

/// Returns the cells of a line of comma-separated values, each without blanks around it. There are no quotes.
std::vector<std::string> cells_of(std::string_view line);

/// Adds an item to a list in words: "a, b".
void add_to_list(std::string& list, std::string_view item);

/// Returns items in words, "a, b", each as `text_of` has it.
template <class Items, class TextOf = std::identity>
std::string listed(const Items& items, TextOf text_of = {}) {
  std::string list;
  for (const auto& item : items) add_to_list(list, std::invoke(text_of, item));
  return list;
}

}  // namespace phantom::core

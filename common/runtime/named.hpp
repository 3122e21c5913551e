#pragma once

#include <algorithm>
#include <string>

#include "common/core/errors.hpp"

namespace phantom::runtime {

/// Returns the names of the items, as "a, b".
template <class Items>
std::string names_of(const Items& items) {
  std::string list;
  for (const auto& item : items) list += (list.empty() ? "" : ", ") + item.name;
  return list;
}

/// Returns the item called `name`. Throws ConfigError of `missing` and the names that are allowed.
template <class Items>
const auto& find_named(const Items& items, const std::string& name, const std::string& missing) {
  const auto found = std::ranges::find_if(items, [&](const auto& item) { return item.name == name; });
  if (found == items.end()) throw core::ConfigError(missing + "; allowed: " + names_of(items));
  return *found;
}

}  // namespace phantom::runtime

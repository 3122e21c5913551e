#pragma once

#include <algorithm>
#include <string>

#include "common/core/errors.hpp"
#include "common/core/text.hpp"

namespace phantom::runtime {

/// Returns the item called `name`. Throws ConfigError of `missing` and the names that are allowed.
template <class Items>
const auto& find_named(const Items& items, const std::string& name, const std::string& missing) {
  const auto found = std::ranges::find_if(items, [&](const auto& item) { return item.name == name; });
  if (found == items.end())
    throw core::ConfigError(missing +
                            "; allowed: " + core::listed(items, [](const auto& item) { return item.name; }));
  return *found;
}

}  // namespace phantom::runtime

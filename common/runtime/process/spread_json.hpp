#pragma once

#include <algorithm>
#include <nlohmann/json.hpp>
#include <vector>

namespace phantom::runtime {

/// Returns the distribution of `values` as JSON for the components' reports: {p50, p99, max, n}, the first
/// three in the values' unit; null without any. Not real-time safe.
template <class T>
nlohmann::json spread_json(std::vector<T> values) {
  if (values.empty()) return nullptr;
  std::sort(values.begin(), values.end());
  const auto at = [&values](double share) {
    return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
  };
  return {{"p50", at(0.5)}, {"p99", at(0.99)}, {"max", values.back()}, {"n", values.size()}};
}

}  // namespace phantom::runtime

#include "common/diagnostics/name_filter.hpp"

#include <fnmatch.h>

#include <algorithm>

namespace phantom::diagnostics {
namespace {

bool any_matches(const std::vector<std::string>& patterns, const std::string& name) {
  return std::any_of(patterns.begin(), patterns.end(), [&](const std::string& pattern) {
    return fnmatch(pattern.c_str(), name.c_str(), 0) == 0;
  });
}

}  // namespace

NameFilter::NameFilter(const std::vector<std::string>& patterns) {
  for (const std::string& pattern : patterns) {
    if (pattern.starts_with('!')) {
      unwanted_.push_back(pattern.substr(1));
    } else {
      wanted_.push_back(pattern);
    }
  }
}

bool NameFilter::keeps(const std::string& name) const {
  return (wanted_.empty() || any_matches(wanted_, name)) && !any_matches(unwanted_, name);
}

}  // namespace phantom::diagnostics

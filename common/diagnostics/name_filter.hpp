#pragma once

#include <string>
#include <vector>

namespace phantom::diagnostics {

/// Selects names by shell patterns (* any text, ? one character, [ab] one of these). A name that matches any
/// pattern is kept; a pattern that begins with ! excludes names. Without patterns, or with only excluding
/// ones, all other names are kept.
///
///     NameFilter({"*_state", "!master_*"}) keeps slave_state
class NameFilter {
 public:
  NameFilter() = default;
  explicit NameFilter(const std::vector<std::string>& patterns);
  bool keeps(const std::string& name) const;
  bool excludes() const { return !unwanted_.empty(); }
  bool keeps_all() const { return wanted_.empty() && unwanted_.empty(); }

 private:
  std::vector<std::string> wanted_, unwanted_;
};

}  // namespace phantom::diagnostics

#pragma once

#include <string>
#include <vector>

namespace phantom::diagnostics {

/// Which names are meant: shell patterns (* any text, ? one character, [ab] one of these), each kept by any
/// of them; a pattern that begins with ! takes away. No pattern, or only those that take away: all names.
///
///     NameFilter({"*_state", "!master_*"}) keeps slave_state
class NameFilter {
 public:
  NameFilter() = default;
  explicit NameFilter(const std::vector<std::string>& patterns);
  bool keeps(const std::string& name) const;
  bool keeps_all() const { return wanted_.empty() && unwanted_.empty(); }

 private:
  std::vector<std::string> wanted_, unwanted_;
};

}  // namespace phantom::diagnostics

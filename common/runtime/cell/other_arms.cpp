#include "common/runtime/cell/other_arms.hpp"

#include <algorithm>
#include <cctype>

#include "common/runtime/configuration/fields.hpp"

namespace phantom::runtime {

void check_partition(const Fields& fields, const std::string& partition) {
  fields.check(std::all_of(partition.begin(), partition.end(),
                           [](char c) {
                             return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' ||
                                    c == '-' || c == '.' || c == '/';
                           }),
               "partition", "is no name of a partition; allowed: A-Z a-z 0-9 _ - . /");
}

std::vector<OtherArmConfig> read_other_arms(const Fields& file) {
  std::vector<OtherArmConfig> arms;
  if (!file.has("other_arms")) return arms;
  for (const Fields& other : file.sections("other_arms")) {
    arms.push_back({other.text("arm"), other.text("partition")});
    check_partition(other, arms.back().partition);
  }
  file.check(arms.size() <= kMaxOtherArms, "other_arms",
             "has " + std::to_string(arms.size()) + " arms; allowed: up to " + std::to_string(kMaxOtherArms));
  return arms;
}

}  // namespace phantom::runtime

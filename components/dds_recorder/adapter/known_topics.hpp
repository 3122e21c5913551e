#pragma once

#include <cstdint>
#include <set>
#include <string>

namespace phantom::dds_recorder {

/// The topics that were heard of. Whoever announces writers can invent names, and each that is recorded costs
/// a reader until the end, so that of topics that are not the project's only so many are. Not thread-safe.
class KnownTopics {
 public:
  static constexpr std::size_t kMaxForeign = 256;

  /// Notes a topic of the project.
  void add_own(const std::string& name) { own_.insert(name); }
  /// Returns whether that topic, of somebody else, is new and there is room for it.
  bool is_fresh(const std::string& name) {
    if (own_.contains(name) || foreign_.contains(name)) return false;
    if (foreign_.size() == kMaxForeign) {
      ++left_out_;
      return false;
    }
    foreign_.insert(name);
    return true;
  }
  /// Returns how many writers were announced of topics for which there was no room.
  std::uint64_t left_out() const { return left_out_; }

 private:
  std::set<std::string> own_, foreign_;
  std::uint64_t left_out_ = 0;
};

}  // namespace phantom::dds_recorder

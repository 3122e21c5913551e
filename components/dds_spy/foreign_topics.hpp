#pragma once

#include <set>
#include <string>
#include <utility>

namespace phantom::dds_spy {

/// The topics that are read and are not the project's. Whoever announces writers can invent names, and each
/// costs a reader, so that kMax are read at once. Not thread-safe.
class ForeignTopics {
 public:
  static constexpr std::size_t kMax = 256;

  /// Returns whether that topic is to be read. If there is no room, the readers of topics that nobody writes
  /// any more are dropped: calls drop(topic) for each that is not is_written(topic).
  template <class IsWritten, class Drop>
  bool admit(const std::string& topic, IsWritten&& is_written, Drop&& drop) {
    if (read_.contains(topic)) return true;
    if (read_.size() == kMax) {
      std::erase_if(read_, [&](const std::string& known) {
        if (is_written(known)) return false;
        drop(known);
        return true;
      });
    }
    if (read_.size() < kMax) return read_.insert(topic).second;
    if (!std::exchange(was_full_, true))
      problem_ = "there are more than " + std::to_string(kMax) +
                 " topics that are not the project's; further ones are not read until others end";
    return false;
  }
  std::size_t size() const { return read_.size(); }
  /// Returns, once, that there are too many; otherwise "".
  std::string take_problem() { return std::exchange(problem_, {}); }

 private:
  std::set<std::string> read_;
  bool was_full_ = false;
  std::string problem_;
};

}  // namespace phantom::dds_spy

#pragma once

#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "common/diagnostics/type.hpp"

namespace phantom::ros2::test {

/// Makes messages of any type that are sound, absurd or none at all, from a seed. `words`: what strings are
/// made of beside garbage, so that some get past the first check.
class Garbage {
 public:
  Garbage(std::uint32_t seed, std::vector<std::string> words) : random_(seed), words_(std::move(words)) {}

  /// Returns CDR with its encapsulation header: in one of three cases whole, with NaN, infinities and absurd
  /// numbers in it; else cut, with other octets, with sequences that claim more than there is, or nothing but
  /// random octets.
  std::vector<std::uint8_t> message(const diagnostics::Type& type);

 private:
  std::uint32_t below(std::uint32_t bound) { return bound == 0 ? 0 : random_() % bound; }
  void put(const diagnostics::Type& type);
  void put_number(std::size_t octets);
  void put_length(std::uint32_t length);
  void put_text();
  double real();

  std::mt19937 random_;
  std::vector<std::string> words_;
  std::vector<std::uint8_t> bytes_;
  bool lies_ = false;
};

}  // namespace phantom::ros2::test

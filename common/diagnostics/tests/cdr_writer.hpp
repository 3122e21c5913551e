#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <string>
#include <vector>

namespace phantom::diagnostics {

/// Writes plain CDR octet by octet, as the standard says: the tests' own oracle.
class CdrWriter {
 public:
  explicit CdrWriter(bool little_endian = true)
      : little_(little_endian), bytes_{0, static_cast<std::uint8_t>(little_ ? 1 : 0), 0, 0} {}

  template <class T>
  CdrWriter& put(T value) {
    while ((bytes_.size() - 4) % sizeof(T) != 0) bytes_.push_back(0);
    auto raw = std::bit_cast<std::array<std::uint8_t, sizeof(T)>>(value);
    if (!little_) std::reverse(raw.begin(), raw.end());
    bytes_.insert(bytes_.end(), raw.begin(), raw.end());
    return *this;
  }
  CdrWriter& text(const std::string& value) {
    put(static_cast<std::uint32_t>(value.size() + 1));
    bytes_.insert(bytes_.end(), value.begin(), value.end());
    bytes_.push_back(0);
    return *this;
  }
  const std::vector<std::uint8_t>& bytes() const { return bytes_; }

 private:
  bool little_;
  std::vector<std::uint8_t> bytes_;
};

}  // namespace phantom::diagnostics

#pragma once

#include <termios.h>

#include <cstddef>
#include <string>
#include <vector>

namespace phantom::dds_spy {

/// Shows lines on the controlling terminal and reads single keys. The terminal shows its alternate screen
/// while an object lives; the destructor restores it.
class Terminal {
 public:
  Terminal();
  ~Terminal();
  Terminal(const Terminal&) = delete;
  Terminal& operator=(const Terminal&) = delete;

  /// Returns whether standard input and output are a terminal.
  static bool available();
  std::size_t columns() const;
  std::size_t rows() const;
  /// Returns the keys pressed since the last call; waits at most `limit_s` for the first.
  std::vector<int> keys(double limit_s);
  void draw(const std::vector<std::string>& lines);

 private:
  termios before_{};
};

/// Returns the keys in the octets from a terminal; an escape sequence of an arrow or page key becomes one
/// key.
std::vector<int> decode_keys(const std::string& octets);

}  // namespace phantom::dds_spy

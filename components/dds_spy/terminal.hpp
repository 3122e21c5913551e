#pragma once

#include <termios.h>

#include <cstddef>
#include <string>
#include <vector>

namespace phantom::dds_spy {

/// The controlling terminal as a screen of lines, with keys read one by one. While one lives, the terminal
/// shows its alternate screen; it is as before afterwards.
class Terminal {
 public:
  Terminal();
  ~Terminal();
  Terminal(const Terminal&) = delete;
  Terminal& operator=(const Terminal&) = delete;

  /// Whether standard input and output are a terminal.
  static bool available();
  std::size_t columns() const;
  std::size_t rows() const;
  /// Keys that were pressed since; waits at most `limit_s` for the first.
  std::vector<int> keys(double limit_s);
  void draw(const std::vector<std::string>& lines);

 private:
  termios before_{};
};

/// Keys in the octets that a terminal sends: escape sequences of arrows and pages become one key each.
std::vector<int> decode_keys(const std::string& octets);

}  // namespace phantom::dds_spy

#pragma once

#include <linux/input.h>
#include <sys/ioctl.h>

#include <array>
#include <bitset>
#include <cstddef>
#include <string>
#include <vector>

namespace phantom::runtime {

/// Returns the event files of /dev/input, sorted by name.
std::vector<std::string> input_files();

/// Returns the name that the open input device gives itself; empty if it gives none.
std::string input_name(int fd);

/// Returns which of the codes of an event kind (EV_KEY, EV_ABS …) the open input device can send.
template <std::size_t Bits>
std::bitset<Bits> input_codes(int fd, int kind) {
  std::array<unsigned char, (Bits + 7) / 8> bytes{};
  std::bitset<Bits> bits;
  if (ioctl(fd, EVIOCGBIT(static_cast<unsigned>(kind), bytes.size()), bytes.data()) < 0) return bits;
  for (std::size_t i = 0; i < Bits; ++i) bits[i] = (bytes[i / 8] >> (i % 8) & 1) != 0;
  return bits;
}

}  // namespace phantom::runtime

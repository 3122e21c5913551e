#pragma once
// Frames of a WebSocket as a client makes and reads them, by hand.

#include <array>
#include <cstdint>
#include <string>

namespace phantom::web::test {

/// A masked frame of at most 65535 octets.
inline std::string client_frame(int opcode, const std::string& content, bool last = true) {
  constexpr std::array<unsigned char, 4> kMask{0x37, 0xFA, 0x21, 0x3D};
  std::string frame(1, static_cast<char>((last ? 0x80 : 0) | opcode));
  if (content.size() < 126) {
    frame += static_cast<char>(0x80 | content.size());
  } else {
    frame += static_cast<char>(0xFE);
    frame += static_cast<char>(content.size() >> 8);
    frame += static_cast<char>(content.size() & 0xFF);
  }
  frame.append(kMask.begin(), kMask.end());
  for (std::size_t i = 0; i < content.size(); ++i)
    frame += static_cast<char>(static_cast<unsigned char>(content[i]) ^ kMask[i % 4]);
  return frame;
}

struct ServerFrame {
  int opcode = 0;
  std::string content;
};

/// Takes the first whole frame off what a server has sent. Returns false if there is none.
inline bool take_frame(std::string& octets, ServerFrame& frame) {
  const auto octet = [&](std::size_t at) { return static_cast<std::uint8_t>(octets[at]); };
  if (octets.size() < 2) return false;
  std::size_t size = octet(1), head = 2;  // a server does not mask
  const std::size_t more = size == 126 ? 2 : size == 127 ? 8 : 0;
  if (octets.size() < 2 + more) return false;
  if (more > 0) size = 0;
  for (std::size_t i = 0; i < more; ++i) size = size << 8 | octet(head++);
  if (octets.size() < head + size) return false;
  frame = {octet(0) & 0x0F, octets.substr(head, size)};
  octets.erase(0, head + size);
  return true;
}

/// The code of the first frame if that is a farewell, else 0.
inline int close_code(std::string octets) {
  ServerFrame frame;
  if (!take_frame(octets, frame) || frame.opcode != 8 || frame.content.size() < 2) return 0;
  return static_cast<std::uint8_t>(frame.content[0]) << 8 | static_cast<std::uint8_t>(frame.content[1]);
}

}  // namespace phantom::web::test

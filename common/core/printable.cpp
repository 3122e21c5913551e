#include "common/core/printable.hpp"

#include <cstddef>

#include "common/core/text.hpp"
#include "common/core/utf8.hpp"

namespace phantom::core {
namespace {

/// A character of a text: its bytes and its code point.
struct Character {
  std::size_t bytes = 1;
  char32_t code = 0;
  bool well_formed = true;
};

// Returns the first character of a text that is not empty.
Character first_of(std::string_view text) noexcept {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned first = byte(0);
  if (first < 0x80) return {1, first, true};
  const std::size_t bytes = first >= 0xf0 ? 4 : first >= 0xe0 ? 3 : 2;
  if (utf8_prefix(text.substr(0, bytes)) != bytes) return {1, first, false};
  char32_t code = first & (0xffU >> (bytes + 1));
  for (std::size_t i = 1; i < bytes; ++i) code = (code << 6U) | (byte(i) & 0x3fU);
  return {bytes, code, true};
}

bool is_hidden(char32_t code) noexcept {
  const auto within = [code](char32_t least, char32_t most) { return code >= least && code <= most; };
  return code < 0x20 || within(0x7f, 0x9f) || code == 0xad || code == 0x61c || within(0x200b, 0x200f) ||
         within(0x2028, 0x202e) || within(0x2060, 0x206f) || code == 0xfeff;
}

std::string escape(const Character& at) {
  if (at.code == '\n') return "\\n";
  if (at.code == '\r') return "\\r";
  if (at.code == '\t') return "\\t";
  const auto code = static_cast<unsigned>(at.code);
  return at.code < 0x80 || !at.well_formed ? formatted("\\x%02x", code) : formatted("\\u%04x", code);
}

}  // namespace

bool is_printable(std::string_view text) noexcept {
  while (!text.empty()) {
    const Character at = first_of(text);
    if (!at.well_formed || is_hidden(at.code)) return false;
    text.remove_prefix(at.bytes);
  }
  return true;
}

std::string printable(std::string_view text) {
  std::string shown;
  shown.reserve(text.size());
  while (!text.empty()) {
    const Character at = first_of(text);
    if (!at.well_formed || is_hidden(at.code)) {
      shown += escape(at);
    } else {
      shown += text.substr(0, at.bytes);
    }
    text.remove_prefix(at.bytes);
  }
  return shown;
}

}  // namespace phantom::core

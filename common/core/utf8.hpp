#pragma once

#include <algorithm>
#include <cstddef>
#include <string>
#include <string_view>

namespace phantom::core {

/// Returns the number of leading bytes of `text` that are well-formed UTF-8 (Unicode standard, table 3-7:
/// neither overlong nor surrogate): the length of `text` if all of it is. Real-time safe.
constexpr std::size_t utf8_prefix(std::string_view text) noexcept {
  const auto byte = [&](std::size_t i) { return i < text.size() ? static_cast<unsigned char>(text[i]) : 0U; };
  std::size_t at = 0;
  while (at < text.size()) {
    const unsigned first = byte(at), second = byte(at + 1);
    std::size_t more = 0;  // bytes that follow the first
    if (first >= 0xc2 && first <= 0xdf) more = 1;
    if (first >= 0xe0 && first <= 0xef) more = 2;
    if (first >= 0xf0 && first <= 0xf4) more = 3;
    if (first >= 0x80 && more == 0) return at;
    const unsigned least = first == 0xe0 ? 0xa0 : first == 0xf0 ? 0x90 : 0x80;
    const unsigned most = first == 0xed ? 0x9f : first == 0xf4 ? 0x8f : 0xbf;
    if (more > 0 && (second < least || second > most)) return at;
    for (std::size_t i = 2; i <= more; ++i) {
      if ((byte(at + i) & 0xc0) != 0x80) return at;
    }
    at += 1 + more;
  }
  return at;
}

constexpr bool is_utf8(std::string_view text) noexcept { return utf8_prefix(text) == text.size(); }

/// Returns whether a byte of UTF-8 is the first of a character.
constexpr bool begins_character(char byte) noexcept {
  return (static_cast<unsigned char>(byte) & 0xc0U) != 0x80U;
}

/// Returns the first `most_bytes` bytes of a UTF-8 text, without a character that would be cut.
inline std::string cut_to_bytes(std::string_view text, std::size_t most_bytes) {
  if (text.size() <= most_bytes) return std::string(text);
  while (most_bytes > 0 && !begins_character(text[most_bytes])) --most_bytes;
  return std::string(text.substr(0, most_bytes));
}

/// Returns the number of characters of a UTF-8 text: its columns on a terminal, if every character takes one.
inline std::size_t columns_of(std::string_view text) {
  return static_cast<std::size_t>(std::count_if(text.begin(), text.end(), begins_character));
}

/// Returns the first `columns` characters of a UTF-8 text.
inline std::string cut_to_columns(std::string_view text, std::size_t columns) {
  std::size_t seen = 0, end = 0;
  while (end < text.size() && !(begins_character(text[end]) && seen++ == columns)) ++end;
  return std::string(text.substr(0, end));
}

}  // namespace phantom::core

#pragma once

#include <string>
#include <string_view>

namespace phantom::core {

/// Returns whether a text is one line that shows what it is: well-formed UTF-8 without control characters
/// (C0, DEL, C1), line and paragraph separators, and characters that change the direction or are invisible
/// (Unicode's bidirectional and zero-width formatting). Real-time safe: yes.
bool is_printable(std::string_view text) noexcept;

/// Returns the text with each character that is_printable() forbids as an escape: "\n", "\t", "\x1b" for a
/// byte, "\u202e" for a character. What else is in the text stays; a backslash stays, too.
std::string printable(std::string_view text);

}  // namespace phantom::core

#include "components/phantom_session/console.hpp"

#include <sys/ioctl.h>
#include <unistd.h>

#include <sstream>

#include "common/core/utf8.hpp"

namespace phantom::phantom_session {
namespace {

constexpr const char *kClearLine = "\r\033[K", *kLineUp = "\033[A";

std::size_t columns() {
  winsize size{};
  const bool known = ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 1;
  return known ? size.ws_col - 1U : 79U;
}

}  // namespace

Console::Console() : out_(STDOUT_FILENO), terminal_(isatty(STDOUT_FILENO) == 1) {}

/// Returns the text that erases the lines below. The cursor is in the last of them.
std::string Console::clear() {
  std::string text;
  for (; shown_ > 0; --shown_) {
    text += kClearLine;
    if (shown_ > 1) text += kLineUp;
  }
  return text;
}

void Console::say(const std::string& line) {
  const std::lock_guard lock(mutex_);
  out_.put(clear() + line + '\n');
}

void Console::show(const std::string& lines) {
  if (!terminal_) return;
  const std::lock_guard lock(mutex_);
  std::string text = clear();
  std::istringstream split(lines);
  for (std::string line; std::getline(split, line); ++shown_)
    text.append(shown_ > 0 ? "\n" : "").append(core::cut_to_columns(line, columns()));
  out_.put(std::move(text));
}

}  // namespace phantom::phantom_session

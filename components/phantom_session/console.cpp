#include "components/phantom_session/console.hpp"

#include <sys/ioctl.h>
#include <unistd.h>

#include <iostream>

namespace phantom::phantom_session {
namespace {

constexpr const char* kClearLine = "\r\033[K";

std::size_t columns() {
  winsize size{};
  const bool known = ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 1;
  return known ? size.ws_col - 1U : 79U;
}

}  // namespace

std::string cut(const std::string& text, std::size_t columns) {
  std::size_t seen = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool begins = (static_cast<unsigned char>(text[i]) & 0xC0U) != 0x80U;
    if (begins && seen++ == columns) return text.substr(0, i);
  }
  return text;
}

Console::Console() : terminal_(isatty(STDOUT_FILENO) == 1) {}

void Console::say(const std::string& line) {
  const std::lock_guard lock(mutex_);
  if (shown_) std::cout << kClearLine;
  shown_ = false;
  std::cout << line << std::endl;
}

void Console::show(const std::string& line) {
  if (!terminal_) return;
  const std::lock_guard lock(mutex_);
  if (shown_ || !line.empty()) std::cout << kClearLine << cut(line, columns()) << std::flush;
  shown_ = !line.empty();
}

}  // namespace phantom::phantom_session

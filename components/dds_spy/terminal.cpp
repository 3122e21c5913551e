#include "components/dds_spy/terminal.hpp"

#include <poll.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <array>
#include <utility>

#include "components/dds_spy/live_view.hpp"

namespace phantom::dds_spy {
namespace {

void put(const std::string& text) {
  std::size_t done = 0;
  while (done < text.size()) {
    const auto written = ::write(STDOUT_FILENO, text.data() + done, text.size() - done);
    if (written <= 0) return;  // the terminal is gone: the next keys() reports that
    done += static_cast<std::size_t>(written);
  }
}

winsize window() {
  winsize size{};
  if (ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_col == 0 || size.ws_row == 0)
    return {24, 80, 0, 0};
  return size;
}

constexpr std::array<std::pair<const char*, int>, 8> kSequences{{{"\x1b[A", kUp},
                                                                 {"\x1b[B", kDown},
                                                                 {"\x1b[C", kRight},
                                                                 {"\x1b[D", kLeft},
                                                                 {"\x1b[5~", kPageUp},
                                                                 {"\x1b[6~", kPageDown},
                                                                 {"\x1bOA", kUp},
                                                                 {"\x1bOB", kDown}}};

}  // namespace

bool Terminal::available() { return isatty(STDIN_FILENO) == 1 && isatty(STDOUT_FILENO) == 1; }

Terminal::Terminal() {
  tcgetattr(STDIN_FILENO, &before_);
  termios raw = before_;
  raw.c_lflag &= static_cast<tcflag_t>(~(ICANON | ECHO));
  raw.c_cc[VMIN] = 0;
  raw.c_cc[VTIME] = 0;
  tcsetattr(STDIN_FILENO, TCSANOW, &raw);
  put("\x1b[?1049h\x1b[?25l");  // alternate screen, no cursor
}

Terminal::~Terminal() {
  put("\x1b[?25h\x1b[?1049l");
  tcsetattr(STDIN_FILENO, TCSANOW, &before_);
}

std::size_t Terminal::columns() const { return window().ws_col; }
std::size_t Terminal::rows() const { return window().ws_row; }

std::vector<int> Terminal::keys(double limit_s) {
  pollfd wait{STDIN_FILENO, POLLIN, 0};
  if (poll(&wait, 1, static_cast<int>(limit_s * 1e3)) <= 0) return {};
  char octets[256];
  const auto count = ::read(STDIN_FILENO, octets, sizeof octets);
  if (count <= 0) return {'q'};  // the terminal is gone
  return decode_keys(std::string(octets, static_cast<std::size_t>(count)));
}

void Terminal::draw(const std::vector<std::string>& lines) {
  std::string picture = "\x1b[H";
  for (std::size_t i = 0; i < lines.size(); ++i) picture += (i == 0 ? "" : "\r\n") + lines[i] + "\x1b[K";
  put(picture + "\x1b[J");
}

std::vector<int> decode_keys(const std::string& octets) {
  std::vector<int> keys;
  for (std::size_t i = 0; i < octets.size();) {
    std::size_t taken = 1;
    int key = static_cast<unsigned char>(octets[i]);
    for (const auto& [sequence, meant] : kSequences) {
      const std::string text(sequence);
      if (octets.compare(i, text.size(), text) != 0) continue;
      key = meant;
      taken = text.size();
    }
    keys.push_back(key);
    i += taken;
  }
  return keys;
}

}  // namespace phantom::dds_spy

#include "components/dds_spy/live_view.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <sstream>
#include <utility>

#include "common/core/utf8.hpp"

namespace phantom::dds_spy {
namespace {

constexpr const char* kTitles[kPages] = {"1 rates", "2 latency", "3 events", "4 topology", "5 qos", "? help"};
constexpr std::size_t kScrollPage = 10;

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

}  // namespace

bool LiveView::take_reset() { return std::exchange(reset_, false); }

void LiveView::type(int key) {
  if (key == kEnter || key == '\r') {
    filter_ = typed_;
    typing_ = false;
  } else if (key == kEscape) {
    typing_ = false;
  } else if (key == kBackspace || key == '\b') {
    if (!typed_.empty()) typed_.pop_back();
  } else if (key >= ' ' && key < kBackspace) {
    typed_ += static_cast<char>(key);
  }
}

void LiveView::press(int key) {
  if (typing_) return type(key);
  const auto go_to = [&](std::size_t page) {
    page_ = static_cast<Page>(page % kPages);
    top_ = 0;
  };
  const auto page = static_cast<std::size_t>(page_);
  switch (key) {
    case 'q':
      quit_ = true;
      break;
    case ' ':
      paused_ = !paused_;
      break;
    case 'r':
      reset_ = true;
      break;
    case '/':
      typing_ = true;
      typed_ = filter_;
      break;
    case '?':
      go_to(static_cast<std::size_t>(Page::kHelp));
      break;
    case kEscape:
      filter_.clear();
      break;
    case '\t':
    case kRight:
      go_to(page + 1);
      break;
    case kLeft:
      go_to(page + kPages - 1);
      break;
    case kUp:
      top_ -= std::min<std::size_t>(top_, 1);
      break;
    case kDown:
      ++top_;
      break;
    case kPageUp:
      top_ -= std::min(top_, kScrollPage);
      break;
    case kPageDown:
      top_ += kScrollPage;
      break;
    default:
      if (key >= '1' && key <= '5') go_to(static_cast<std::size_t>(key - '1'));
  }
}

diagnostics::NameFilter LiveView::filter() const {
  std::vector<std::string> patterns;
  std::istringstream words(filter_);
  for (std::string word; words >> word;) {
    const bool taken_away = word.starts_with('!');
    if (taken_away) word.erase(0, 1);
    if (word.find_first_of("*?[") == std::string::npos) word = fmt::format("*{}*", word);
    patterns.push_back(fmt::format("{}{}", taken_away ? "!" : "", word));
  }
  return diagnostics::NameFilter(patterns);
}

std::vector<std::string> LiveView::screen(const std::string& title, const std::string& body,
                                          std::size_t columns, std::size_t rows) const {
  std::string pages;
  for (std::size_t i = 0; i < kPages; ++i)
    pages += i == static_cast<std::size_t>(page_) ? fmt::format("[{}]", kTitles[i])
                                                  : fmt::format(" {} ", kTitles[i]);
  std::vector<std::string> screen{pages + "  " + title + (paused_ ? "  PAUSED" : "")};
  const auto lines = lines_of(body);
  const std::size_t room = rows > 2 ? rows - 2 : 0;
  top_ = std::min(top_, lines.size() > room ? lines.size() - room : 0);
  for (std::size_t i = top_; i < lines.size() && screen.size() <= room; ++i) screen.push_back(lines[i]);
  screen.resize(std::max<std::size_t>(room + 1, 1));
  std::string keys = typing_ ? fmt::format("topics (Enter: show, Esc: leave it): {}_", typed_)
                             : "q quit  1–5 ←→ pages  ↑↓ scroll  / filter  space pause  r reset counts";
  if (!typing_ && !filter_.empty()) keys += fmt::format("  filter: {} (Esc: all)", filter_);
  if (!typing_ && lines.size() > room)
    keys += fmt::format("  lines {}–{} of {}", top_ + 1, std::min(top_ + room, lines.size()), lines.size());
  screen.push_back(keys);
  screen.resize(std::min(screen.size(), rows));
  for (std::string& line : screen) line = core::cut_to_columns(line, columns);
  return screen;
}

std::string LiveView::help() {
  return "1  rates     samples, rate, period, jitter, gaps of each writer; LATE: "
         "deadlines missed as seen from here\n"
         "2  latency   age of samples on arrival\n"
         "3  events    what happened: joins, losses, gaps, deadlines, liveliness, mismatches\n"
         "4  topology  hosts, processes, topics\n"
         "5  qos       each endpoint's QoS, and who does not communicate, why, and what to do\n"
         "\n"
         "/  filter topics: words, or patterns with * ? [ab]; ! before one takes away\n"
         "r  set counts to zero    space  hold the picture    q  quit\n"
         "\n"
         "The spy reads best effort and volatile: no writer waits for it. What it misses, others may have got:\n"
         "what the components themselves counted is listed under events (component_counter).\n";
}

}  // namespace phantom::dds_spy

#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "common/diagnostics/name_filter.hpp"

namespace phantom::dds_spy {

enum class Page { kRates, kLatency, kEvents, kTopology, kQos, kHelp };
inline constexpr std::size_t kPages = 6;

/// Keys that are not printable characters.
enum Key : int {
  kNoKey = 0,
  kEnter = '\n',
  kEscape = 27,
  kBackspace = 127,
  kUp = 1000,
  kDown,
  kLeft,
  kRight,
  kPageUp,
  kPageDown
};

/// The state of the live view, and how keys change it. Pure: text in, lines out.
class LiveView {
 public:
  void press(int key);
  bool quit() const { return quit_; }
  bool paused() const { return paused_; }
  Page page() const { return page_; }
  /// Returns whether a reset of the counts was requested, and clears the request.
  bool take_reset();
  /// Returns the filter of the topics to show, as typed after '/'. A word without wildcards matches anywhere
  /// in a name.
  diagnostics::NameFilter filter() const;

  /// Returns the screen: a line of pages, the page's text (scrolled, cut to the width) and a line of keys;
  /// exactly `rows` lines.
  std::vector<std::string> screen(const std::string& title, const std::string& body, std::size_t columns,
                                  std::size_t rows) const;
  static std::string help();

 private:
  void type(int key);

  Page page_ = Page::kRates;
  bool quit_ = false, paused_ = false, reset_ = false, typing_ = false;
  std::string filter_, typed_;
  mutable std::size_t top_ = 0;  // scroll position; clamped when drawn
};

}  // namespace phantom::dds_spy

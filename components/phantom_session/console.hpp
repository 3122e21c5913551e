#pragma once

#include <mutex>
#include <string>

#include "common/runtime/line_writer.hpp"

namespace phantom::phantom_session {

/// Standard output: lines that stay, and below them, on a terminal, a few that are overwritten. Elsewhere (a
/// pipe, a file) nothing but the lines that stay is written. Nobody waits for who reads them: threads of DDS
/// say what they hear. Thread-safe.
class Console {
 public:
  /// Finds out whether standard output is a terminal.
  Console();
  bool is_terminal() const { return terminal_; }
  void say(const std::string& line);
  /// Replaces the lines below, each cut to the terminal's width; empty: takes them away. Nothing if this is
  /// no terminal.
  void show(const std::string& lines);

 private:
  std::string clear();

  std::mutex mutex_;
  runtime::LineWriter out_;
  bool terminal_;
  int shown_ = 0;  // lines
};

/// The first `columns` characters (code points) of a UTF-8 text.
std::string cut(const std::string& text, std::size_t columns);

}  // namespace phantom::phantom_session

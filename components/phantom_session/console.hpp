#pragma once

#include <mutex>
#include <string>

#include "common/runtime/process/line_writer.hpp"

namespace phantom::phantom_session {

/// Writes to standard output: lines that stay and, on a terminal, a few lines below them that are
/// overwritten. Writes only the lines that stay if standard output is a pipe or a file. Calls never wait for
/// a slow reader, because DDS threads write here. Thread-safe.
class Console {
 public:
  /// Finds out whether standard output is a terminal.
  Console();
  bool is_terminal() const { return terminal_; }
  void say(const std::string& line);
  /// Replaces the lines below, each cut to the terminal's width; an empty text removes them. Does nothing if
  /// standard output is not a terminal.
  void show(const std::string& lines);

 private:
  std::string clear();

  std::mutex mutex_;
  runtime::LineWriter out_;
  bool terminal_;
  int shown_ = 0;  // number of lines below
};

}  // namespace phantom::phantom_session

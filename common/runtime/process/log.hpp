#pragma once

#include <string>

namespace phantom::runtime {

/// Sends spdlog's default logger and print_line() to standard error through a LineWriter, so that no log call
/// waits for the reader. `component`: the name in every line. `level`: as --log-level. Call it once in a
/// process; the log lasts until the process ends.
void begin_log(const std::string& component, const std::string& level);

/// Writes a line without time and level to standard error, in order with the lines of the log. Writes
/// directly to standard error if the log has not begun.
void print_line(const std::string& line);

/// Waits at most 0.2 s until the log has been written; the reader may be gone. Call it last.
void finish_log() noexcept;

}  // namespace phantom::runtime

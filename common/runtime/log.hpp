#pragma once

#include <string>

namespace phantom::runtime {

/// Lets spdlog's default logger, and say(), write to standard error by a LineWriter: no log call waits for
/// who reads it. `component`: the name in every line. `level`: as --log-level. Once in a process; the log
/// stays until the process ends. What a crash would take along (std::terminate) is written before it.
void begin_log(const std::string& component, const std::string& level);

/// A line on standard error without time and level, in order with those of the log; straight to standard
/// error if no log was begun.
void say(const std::string& line);

/// Waits until what was logged has been written, at most 0.2 s: somebody may not read it. Call it last.
void finish_log() noexcept;

}  // namespace phantom::runtime

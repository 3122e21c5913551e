#include "common/runtime/process/log.hpp"

#include <spdlog/fmt/fmt.h>
#include <spdlog/sinks/sink.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <ctime>
#include <iostream>
#include <string_view>

#include "common/core/printable.hpp"
#include "common/runtime/process/line_writer.hpp"

namespace phantom::runtime {
namespace {

constexpr const char* kPlain = "\033[m";

LineWriter* g_lines = nullptr;  // never deleted: threads may log until the process ends

const char* colour_of(spdlog::level::level_enum level) {
  switch (level) {
    case spdlog::level::warn:
      return "\033[33m\033[1m";
    case spdlog::level::err:
    case spdlog::level::critical:
      return "\033[31m\033[1m";
    case spdlog::level::info:
      return "\033[32m";
    default:
      return "\033[36m";
  }
}

/// Formats a message as one line and queues it. Characters that would forge or hide text are escaped, because
/// names and messages of other processes stand in the log. It needs no lock of its own.
class QueueSink final : public spdlog::sinks::sink {
 public:
  explicit QueueSink(LineWriter& lines) : lines_(lines), coloured_(isatty(STDERR_FILENO) == 1) {}

  void log(const spdlog::details::log_msg& message) override {
    using std::chrono::system_clock;
    const auto ms =
        std::chrono::duration_cast<std::chrono::milliseconds>(message.time.time_since_epoch()).count();
    const std::time_t seconds = system_clock::to_time_t(message.time);
    std::tm local{};
    localtime_r(&seconds, &local);
    const auto level = spdlog::level::to_string_view(message.level);
    lines_.put(fmt::format("{:02}:{:02}:{:02}.{:03} {}{:<8}{} {}: {}\n", local.tm_hour, local.tm_min,
                           local.tm_sec, ms % 1000, coloured_ ? colour_of(message.level) : "",
                           std::string_view(level.data(), level.size()), coloured_ ? kPlain : "",
                           std::string_view(message.logger_name.data(), message.logger_name.size()),
                           core::printable({message.payload.data(), message.payload.size()})));
  }
  void flush() override {}  // the writer's thread writes at once
  void set_pattern(const std::string&) override {}
  void set_formatter(std::unique_ptr<spdlog::formatter>) override {}

 private:
  LineWriter& lines_;
  bool coloured_;
};

}  // namespace

void begin_log(const std::string& component, const std::string& level) {
  g_lines = new LineWriter(STDERR_FILENO);
  spdlog::set_default_logger(
      std::make_shared<spdlog::logger>(component, std::make_shared<QueueSink>(*g_lines)));
  spdlog::set_level(spdlog::level::from_str(level));
}

void print_line(const std::string& line) {
  // What others named or sent may be in it: only its own line breaks and tabs stay.
  std::string shown;
  for (std::size_t at = 0; at <= line.size();) {
    const std::size_t end = std::min(line.find_first_of("\n\t", at), line.size());
    shown += core::printable(std::string_view(line).substr(at, end - at));
    shown += end < line.size() ? line[end] : '\n';
    at = end + 1;
  }
  if (g_lines != nullptr) {
    g_lines->put(shown);
  } else {
    std::cerr << shown;
  }
}

void finish_log() noexcept {
  if (g_lines != nullptr) g_lines->flush(LineWriter::kGrace_s);
}

}  // namespace phantom::runtime

#include "components/workspace_survey/head/head_driver.hpp"

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <spdlog/fmt/fmt.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>

#include "common/core/clock.hpp"
#include "common/core/errors.hpp"
#include "common/core/units.hpp"

namespace phantom::workspace_survey {
namespace {

using core::ErrorCode;
using core::Expected;
using core::Status;
using survey::Reading;

constexpr double kPatience_s = 1.0;  // for a driver to end by itself

double monotonic_s() { return core::seconds(core::monotonic_ns()); }

/// Waits until a file can be read or written. Returns false once the time has come.
bool wait_for_file(int file, short events, double until_s) {
  for (;;) {
    const double left_s = until_s - monotonic_s();
    if (left_s <= 0.0) return false;
    pollfd wait{file, events, 0};
    if (poll(&wait, 1, static_cast<int>(1e3 * left_s) + 1) > 0) return true;
  }
}

void close_file(int& file) {
  if (file >= 0) close(file);
  file = -1;
}

/// Waits for the process' end for at most that long.
bool ends_within(pid_t process, double wait_s, int& status) {
  for (const double until_s = monotonic_s() + wait_s;;) {
    if (waitpid(process, &status, WNOHANG) != 0) return true;
    if (monotonic_s() >= until_s) return false;
    poll(nullptr, 0, 10);
  }
}

}  // namespace

HeadDriver::HeadDriver(std::string command, const survey::RangeHead& head, double timeout_s)
    : command_(std::move(command)), head_(head), timeout_s_(timeout_s) {
  start();
  const HeadRequest request{.operation = HeadOperation::kDescribe};
  const auto line = ask(request);
  if (!line) {
    end_of_driver();
    if (line.status().code() == ErrorCode::kInvalidArgument) throw core::ConfigError(line.status().message());
    throw core::MissingError(line.status().message());
  }
  const auto description = parse_description(*line);
  if (!description) {
    end_of_driver();
    throw core::ConfigError(error(request, description.status()).message());
  }
  description_ = *description;
}

HeadDriver::~HeadDriver() { end_of_driver(); }

/// Starts the driver in a process group of its own, with pipes as its standard input and output.
void HeadDriver::start() {
  int to[2], from[2];
  if (pipe2(to, O_CLOEXEC) != 0) throw core::MissingError(std::string("--driver: ") + std::strerror(errno));
  if (pipe2(from, O_CLOEXEC) != 0) {
    close(to[0]), close(to[1]);
    throw core::MissingError(std::string("--driver: ") + std::strerror(errno));
  }
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_adddup2(&files, to[0], STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&files, from[1], STDOUT_FILENO);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  sigset_t none, all;
  sigemptyset(&none);
  sigfillset(&all);
  posix_spawnattr_setsigmask(&attributes, &none);
  posix_spawnattr_setsigdefault(&attributes, &all);
  posix_spawnattr_setpgroup(&attributes, 0);
  posix_spawnattr_setflags(&attributes,
                           POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETPGROUP);
  std::string shell = "sh", option = "-c";
  char* words[] = {shell.data(), option.data(), command_.data(), nullptr};
  const int problem = posix_spawn(&process_, "/bin/sh", &files, &attributes, words, environ);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&files);
  close(to[0]), close(from[1]);
  to_driver_ = to[1], from_driver_ = from[0];
  fcntl(to_driver_, F_SETFL, O_NONBLOCK);
  if (problem == 0) return;
  process_ = -1;
  end_of_driver();
  throw core::MissingError("--driver: '" + command_ + "' does not start: " + std::strerror(problem));
}

Expected<Reading> HeadDriver::aim(double pan_rad, double tilt_rad) {
  const HeadRequest request{.operation = HeadOperation::kAim, .pan_rad = pan_rad, .tilt_rad = tilt_rad};
  const auto line = ask(request);
  if (!line) return line.status();
  auto direction = parse_direction(*line, {0.0, pan_rad, tilt_rad});
  if (!direction) return error(request, direction.status());
  pointing_ = *direction;
  has_aimed_ = true;
  return direction;
}

Expected<std::vector<Reading>> HeadDriver::measure(int readings) {
  if (!has_aimed_) return Status(ErrorCode::kFailedPrecondition, "the head was not aimed yet; aim it first");
  const HeadRequest request{.operation = HeadOperation::kMeasure, .readings = readings};
  const auto line = ask(request);
  if (!line) return line.status();
  auto taken = parse_readings(*line, head_, pointing_, readings);
  if (!taken) return error(request, taken.status());
  return taken;
}

Status HeadDriver::error(const HeadRequest& request, const Status& why) const {
  return {why.code(),
          fmt::format("head driver '{}': {}: {}", command_, name_of(request.operation), why.message())};
}

/// Returns the line that answers a request.
Expected<std::string> HeadDriver::ask(HeadRequest request) {
  request.id = next_id_++;
  const double until_s = monotonic_s() + timeout_s_;
  if (process_ < 0) return error(request, {ErrorCode::kUnavailable, "has ended"});
  if (auto sent = send(request_line(request) + "\n", until_s); !sent) return error(request, sent);
  for (;;) {
    auto line = next_line(until_s);
    if (!line) return error(request, line.status());
    const auto id = reply_id(*line);
    if (!id) return error(request, id.status());
    if (*id == request.id) return line;
    if (*id > request.id)
      return error(request, Status::invalid_argument(
                                fmt::format("id is {}; allowed: {}, the request's", *id, request.id)));
  }
}

Status HeadDriver::send(const std::string& line, double until_s) const {
  for (std::size_t sent = 0; sent < line.size();) {
    if (!wait_for_file(to_driver_, POLLOUT, until_s))
      return {ErrorCode::kUnavailable, fmt::format("does not read for {:g} s", timeout_s_)};
    const ssize_t count = write(to_driver_, line.data() + sent, line.size() - sent);
    if (count > 0) sent += static_cast<std::size_t>(count);
    if (count < 0 && errno != EINTR && errno != EAGAIN)
      return {};  // it has ended: what it said last says more
  }
  return {};
}

Expected<std::string> HeadDriver::next_line(double until_s) {
  for (;;) {
    if (const auto end = received_.find('\n'); end != std::string::npos) {
      std::string line = received_.substr(0, end);
      received_.erase(0, end + 1);
      if (line.find_first_not_of(" \t\r") != std::string::npos) return line;
      continue;
    }
    if (received_.size() > kMaxHeadLine) {
      received_.clear();
      return Status::invalid_argument(fmt::format("a line is too long; allowed: {} bytes", kMaxHeadLine));
    }
    if (!wait_for_file(from_driver_, POLLIN, until_s))
      return Status(ErrorCode::kUnavailable, fmt::format("does not answer for {:g} s", timeout_s_));
    char block[4096];
    const ssize_t count = read(from_driver_, block, sizeof block);
    if (count > 0) received_.append(block, static_cast<std::size_t>(count));
    if (count == 0) return Status(ErrorCode::kUnavailable, end_of_driver());
  }
}

/// Ends the driver if it does not end by itself; returns how it ended, in words. Whatever it has started ends
/// with it.
std::string HeadDriver::end_of_driver() {
  close_file(to_driver_);
  close_file(from_driver_);
  if (process_ < 0) return "has ended";
  int status = 0;
  if (!ends_within(process_, kPatience_s, status)) {
    kill(-process_, SIGTERM);
    if (!ends_within(process_, kPatience_s, status)) {
      kill(-process_, SIGKILL);
      waitpid(process_, &status, 0);
    }
  }
  kill(-process_, SIGKILL);
  process_ = -1;
  if (WIFSIGNALED(status)) return fmt::format("has ended by signal {}", WTERMSIG(status));
  return fmt::format("has ended with exit code {}", WEXITSTATUS(status));
}

}  // namespace phantom::workspace_survey

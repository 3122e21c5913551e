#include "common/runtime/process/process.hpp"

#include <poll.h>

#include <cstdlib>
#include <filesystem>
#include <iostream>

#include "common/core/clock.hpp"
#include "common/core/errors.hpp"

namespace phantom::runtime {

EndsAtOnce::EndsAtOnce(ExitCode exit_code) noexcept { internal::enter_ends_at_once(exit_code); }
EndsAtOnce::~EndsAtOnce() { internal::leave_ends_at_once(); }

int configuration_is_valid(const std::string& found) {
  std::cout << "configuration is valid" << found << '\n';
  return kExitDone;
}

bool sleep_unless_stopped(double duration_s) {
  const core::Nanoseconds until = core::monotonic_ns() + core::from_seconds(duration_s);
  while (!stop_requested()) {
    const core::Nanoseconds left = until - core::monotonic_ns();
    if (left <= 0) return true;
    pollfd wait{stop_event(), POLLIN, 0};
    const timespec timeout{left / core::kNsPerSecond, left % core::kNsPerSecond};
    ppoll(&wait, 1, &timeout, nullptr);
  }
  return false;
}

std::filesystem::path share_path(const std::filesystem::path& relative) {
  if (const char* given = std::getenv("PHANTOM_SHARE")) return std::filesystem::path(given) / relative;
  const auto self = std::filesystem::read_symlink("/proc/self/exe");
  return self.parent_path().parent_path() / "share" / "phantom" / relative;
}

}  // namespace phantom::runtime

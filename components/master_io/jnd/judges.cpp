#include "components/master_io/jnd/judges.hpp"

#include <poll.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <ostream>

#include "common/core/text.hpp"
#include "common/runtime/process/signals.hpp"

namespace phantom::master_io {
namespace {

core::Status given_up(const char* why) { return {core::ErrorCode::kFailedPrecondition, why}; }

}  // namespace

void AskedPerson::begin(int trial, int interval) {
  out_ << core::formatted("trial %d, drag %d: move %s to and fro, alike in both\n", trial, interval,
                          joint_name_.c_str())
       << std::flush;
}

core::Expected<std::string> AskedPerson::line() {
  while (true) {
    if (const auto end = unread_.find('\n'); end != std::string::npos) {
      std::string text(core::trimmed(std::string_view(unread_).substr(0, end)));
      unread_.erase(0, end + 1);
      return text;
    }
    std::array<pollfd, 2> ready{pollfd{in_, POLLIN, 0}, pollfd{runtime::stop_event(), POLLIN, 0}};
    if (poll(ready.data(), ready.size(), -1) < 0 && errno != EINTR)
      return given_up("the answer: poll failed");
    if (runtime::stop_requested()) return given_up("interrupted");
    if (ready[0].revents == 0) continue;
    std::array<char, 256> bytes{};
    const ssize_t count = read(in_, bytes.data(), bytes.size());
    if (count <= 0) return given_up("no more answers");
    unread_.append(bytes.data(), static_cast<std::size_t>(count));
  }
}

core::Expected<bool> AskedPerson::calls_first_greater(double, double) {
  while (true) {
    out_ << "which was more viscous, 1 or 2? (q: give up) " << std::flush;
    const auto answer = line();
    if (!answer) return answer.status();
    if (*answer == "1" || *answer == "2") return *answer == "1";
    if (*answer == "q") return given_up("given up");
  }
}

}  // namespace phantom::master_io

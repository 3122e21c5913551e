#pragma once

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "common/dds/endpoint.hpp"
#include "common/dds/stamp.hpp"

namespace phantom::dds {

/// Returns this process's name for the logs of components that it sends commands to: "NAME, process 4711 on
/// host".
inline std::string requester_name(const std::string& name) {
  char host[65] = {};
  gethostname(host, sizeof host - 1);
  return name + ", process " + std::to_string(getpid()) + " on " + host;
}

/// The client end of a pair of topics in which every Command is answered by Replies that echo its stamp
/// (workspace_command, sensing_command, operator_command). CommandService is the server end. For one thread,
/// and one Requester per topic and participant: a command is identified by the participant's session and its
/// number.
template <class Command, class Reply>
class Requester {
 public:
  /// Throws DdsError.
  Requester(Participant& participant, const TopicSpec<Command>& commands, const TopicSpec<Reply>& replies)
      : stamper_(participant),
        writer_(participant, commands),
        reader_(participant, replies, [this](const Reply& reply, const SampleInfo&) {
          {
            const std::lock_guard lock(mutex_);
            replies_.push_back(reply);
          }
          changed_.notify_one();
        }) {}

  /// Stamps and sends the command. Repeats it until it is answered (a CommandService carries it out once),
  /// and at once when another process joins that may answer. Passes each new reply once to `is_last`, which
  /// returns true when no further reply is expected; if several components answer, it must count them.
  /// Returns true once `is_last` does, false if no new reply came for `timeout_s`.
  bool ask(Command command, double timeout_s, const std::function<bool(const Reply&)>& is_last) {
    command.stamp(stamper_.next());
    const auto timeout =
        std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(timeout_s));
    auto give_up = Clock::now() + timeout, say_again = Clock::now();
    std::uint32_t heard_by = 0;
    std::vector<Reply> said;
    while (Clock::now() < give_up) {
      const std::uint32_t ends = std::min(writer_.matched(), reader_.matched());
      if (ends > heard_by || (ends > 0 && Clock::now() >= say_again)) {
        writer_.write(command);
        say_again = Clock::now() + kAgain;
      }
      heard_by = ends;
      for (Reply& reply : wait_until(std::min(give_up, Clock::now() + kLook))) {
        const auto& echo = reply.command();
        if (echo.session() != command.stamp().session() ||
            echo.sequence_number() != command.stamp().sequence_number())
          continue;  // the answer to another requester
        reply.stamp({});
        if (std::find(said.begin(), said.end(), reply) != said.end()) continue;  // repeated
        said.push_back(reply);
        if (is_last(reply)) return true;
        give_up = Clock::now() + timeout;
      }
    }
    return false;
  }

 private:
  using Clock = std::chrono::steady_clock;
  // A reply may have been sent before our reader was matched.
  static constexpr std::chrono::milliseconds kAgain{100};
  static constexpr std::chrono::milliseconds kLook{20};

  std::deque<Reply> wait_until(Clock::time_point until) {
    std::unique_lock lock(mutex_);
    changed_.wait_until(lock, until, [this] { return !replies_.empty(); });
    return std::exchange(replies_, {});
  }

  Stamper stamper_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Reply> replies_;
  Writer<Command> writer_;
  Reader<Reply> reader_;
};

}  // namespace phantom::dds

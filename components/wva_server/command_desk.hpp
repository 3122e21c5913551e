#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>
#include <string>

#include "components/wva_server/wva_server.hpp"

namespace phantom::wva_server {

/// Names a command: the session and number of its stamp.
struct CommandId {
  std::uint64_t session = 0, number = 0;
  friend bool operator==(const CommandId&, const CommandId&) = default;
};

/// A command as it came.
struct Request {
  CommandId id;
  std::int64_t monotonic_ns = 0;  ///< of its stamp, to be echoed
  std::string requester;
  CellCommand command;
};

enum class Outcome { kAccepted, kDone, kRefused };

/// What is said to who asked.
struct Reply {
  Outcome outcome = Outcome::kAccepted;
  std::string message;
  std::uint16_t object_id = 0;
  std::string object;
  std::uint64_t version = 0;
  std::size_t changed_bricks = 0, removed_bricks = 0;
  double seconds = 0.0;
};

/// Where commands wait their turn, in the order in which they came. A command that comes again (who sent it
/// got no reply) is not carried out again: its last reply is said again. Thread-safe.
class CommandDesk {
 public:
  static constexpr std::size_t kMostWaiting = 64, kMostRemembered = 256;

  /// Takes a command in; returns what to reply at once: accepted, refused, or what was replied before.
  Reply take_in(Request request);
  /// The next command, waiting for one at most `wait_s`.
  std::optional<Request> next(double wait_s);
  /// Notes the reply to a command, for when it comes again.
  void replied(const CommandId& id, const Reply& reply);

 private:
  std::mutex mutex_;
  std::condition_variable came_;
  std::deque<Request> waiting_;
  std::deque<std::pair<CommandId, Reply>> known_;  // the newest last
};

}  // namespace phantom::wva_server

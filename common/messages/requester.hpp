#pragma once

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "common/core/host/host_interfaces.hpp"
#include "common/dds/endpoints/endpoint.hpp"
#include "common/dds/endpoints/stamp.hpp"
#include "common/messages/arm_bounds.hpp"
#include "common/messages/repeat_rule.hpp"

namespace phantom::messages {

/// Returns this process's name for the logs of components that it sends commands to: "NAME, process 4711 on
/// host".
inline std::string requester_name(const std::string& name) {
  return name + ", process " + std::to_string(getpid()) + " on " + core::host_name();
}

/// The client end of a pair of topics in which every Command is answered by Replies that echo its stamp
/// (workspace_command, sensing_command, operator_command). CommandService is the server end. For one thread,
/// and one Requester per topic and participant: a command is identified by the participant's session and its
/// number. Include the topics' codec, too.
template <class Command, class Reply>
class Requester {
 public:
  using CommandMessage = decltype(to_idl(std::declval<const Command&>()));
  using ReplyMessage = decltype(to_idl(std::declval<const Reply&>()));

  /// Throws DdsError.
  Requester(dds::Participant& participant, const dds::TopicSpec<CommandMessage>& commands,
            const dds::TopicSpec<ReplyMessage>& replies)
      : stamper_(participant),
        writer_(participant, commands),
        reader_(participant, replies, [this](const ReplyMessage& message, const dds::SampleInfo&) {
          auto reply = from_idl(message, ArmBounds());
          if (!reply) return;
          {
            const std::lock_guard lock(mutex_);
            if (replies_.size() < kMaxWaiting) replies_.push_back(std::move(*reply));
          }
          changed_.notify_one();
        }) {}

  /// Stamps and sends the command. Repeats it until a reply comes (a CommandService carries it out once), and
  /// at once when another process joins that may answer. A command that was replied to is repeated only where
  /// nothing was heard for a while, because its last reply may have been lost (RepeatRule). Passes each new
  /// reply once to `is_last`, which returns true when no further reply is expected; if several components
  /// answer, it must count them. Returns true once `is_last` does, false if it has not within `timeout_s` in
  /// all. Throws core::ConfigError for a command with a text that is too long for the topic.
  bool ask(const Command& command, double timeout_s, const std::function<bool(const Reply&)>& is_last) {
    CommandMessage message = to_idl(command);
    message.stamp(stamper_.next());
    const core::SampleId id = dds::id_of(message.stamp());
    const auto timeout =
        std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(timeout_s));
    const auto give_up = Clock::now() + timeout;
    RepeatRule rule;
    std::deque<Reply> answers;  // the newest
    while (!cancelled_ && Clock::now() < give_up) {
      if (rule.due(Clock::now(), std::min(writer_.matched(), reader_.matched()))) writer_.write(message);
      for (Reply& reply : wait_until(std::min(give_up, Clock::now() + kLook))) {
        if (reply.command != id) continue;  // the answer to another requester
        reply.stamp = {};
        if (std::find(answers.begin(), answers.end(), reply) != answers.end()) continue;  // repeated
        answers.push_back(reply);
        if (answers.size() > kRemembered) answers.pop_front();
        if (is_last(reply)) return true;
        rule.heard(Clock::now());
      }
    }
    return false;
  }
  /// Makes an ask() of another thread return false soon, and every later one at once.
  void cancel() noexcept { cancelled_ = true; }

 private:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::milliseconds kLook{20};
  static constexpr std::size_t kRemembered = 64, kMaxWaiting = 1024;  // replies

  std::deque<Reply> wait_until(Clock::time_point until) {
    std::unique_lock lock(mutex_);
    changed_.wait_until(lock, until, [this] { return !replies_.empty(); });
    return std::exchange(replies_, {});
  }

  dds::Stamper stamper_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Reply> replies_;
  std::atomic<bool> cancelled_{false};
  dds::Writer<CommandMessage> writer_;
  dds::Reader<ReplyMessage> reader_;
};

}  // namespace phantom::messages

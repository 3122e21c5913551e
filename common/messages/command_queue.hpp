#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include "common/core/sample_id.hpp"

namespace phantom::messages {

/// How a component answers the commands of one topic. An empty function is not called. All functions are
/// called on the thread that receives; none may call the queue.
template <class Command, class Reply>
struct CommandRules {
  /// Returns whether the command is for this component. Other commands are ignored without a reply.
  std::function<bool(const Command&)> concerns = {};
  /// Returns why a valid command cannot be used here, and what is allowed; empty if it can be used.
  std::function<std::string(const Command&)> refusal = {};
  /// Returns the reply that refuses the command. Required.
  std::function<Reply(const Command&, const std::string& why)> refused = {};
  /// Returns a first reply to a command that was queued behind `before` others.
  std::function<Reply(const Command&, std::size_t before)> accepted = {};
};

/// Queue that passes commands from the thread that receives them to the thread that carries them out, and
/// replies back. Knows no network.
///
/// A command is identified by its stamp (session and number). Its sender repeats it if it has received no
/// reply; the queue then repeats the newest reply and does not carry the command out again. The queue is
/// bounded. If kMaxOpen commands wait or are being carried out, the next one is refused. If more than
/// kMaxRemembered commands have been answered, the replies to the oldest are forgotten; such a command is
/// refused if it comes again.
///
/// Thread-safe; no caller waits for longer than it takes to move a command or a reply. Real-time safe: no,
/// but next() takes no lock while nothing waits.
///
/// Command has `stamp`; Reply has `command`, which the queue sets to that stamp.
template <class Command, class Reply>
class CommandQueue {
 public:
  static constexpr std::size_t kMaxOpen = 64, kMaxRemembered = 256, kMaxReplies = 256;

  explicit CommandQueue(CommandRules<Command, Reply> rules) : rules_(std::move(rules)) {}

  /// Receives a command; `why`: why it cannot be used, empty if it can. If a reply is due at once,
  /// next_reply() returns it. Returns true if the command is new and waits to be carried out.
  bool receive(const Command& command, std::string why = "") {
    if (rules_.concerns && !rules_.concerns(command)) return false;
    const core::SampleId id = command.stamp;
    if (why.empty() && rules_.refusal) why = rules_.refusal(command);
    const std::lock_guard lock(mutex_);
    if (const Known* known = find(id)) {
      if (known->newest) send(id, *known->newest);
      return false;
    }
    if (why.empty() && was_forgotten(id))
      why = "stamp.sequence_number is one that was carried out long ago; allowed: a new one";
    if (why.empty() && open_ >= kMaxOpen)
      why = std::to_string(open_) + " commands are waiting already; send it again later";
    if (!why.empty()) {
      // Not remembered, so that it can be sent again when there is room.
      send(id, rules_.refused(command, why));
      return false;
    }
    known_.push_back({id, {}, true});
    if (rules_.accepted) {
      known_.back().newest = rules_.accepted(command, open_);
      send(id, *known_.back().newest);
    }
    waiting_.push_back(command);
    waiting_count_.store(waiting_.size(), std::memory_order_release);
    ++open_;
    came_.notify_one();
    return true;
  }

  /// Returns the next command to carry out, which complete() must then answer; nothing if none waits.
  std::optional<Command> next() {
    if (waiting_count_.load(std::memory_order_acquire) == 0) return std::nullopt;
    const std::lock_guard lock(mutex_);
    return take();
  }
  /// As above, but waits for a command for `wait_s` at most.
  std::optional<Command> next(double wait_s) {
    std::unique_lock lock(mutex_);
    came_.wait_for(lock, std::chrono::duration<double>(wait_s), [this] { return !waiting_.empty(); });
    return take();
  }

  /// Answers a command that next() returned, now or at any later time. Returns false, and drops the reply, if
  /// the command was answered before or next() never returned it.
  bool complete(const core::SampleId& id, Reply reply) {
    const std::lock_guard lock(mutex_);
    Known* known = find(id);
    if (known == nullptr || !known->open) return false;
    known->open = false;
    known->newest = std::move(reply);
    --open_;
    send(id, *known->newest);
    forget_oldest();
    return true;
  }

  /// Sends a reply to a command that next() returned and that is still being carried out, such as how far it
  /// is. complete() must follow. Returns false, and drops the reply, if the command was answered before.
  bool notify(const core::SampleId& id, Reply reply) {
    const std::lock_guard lock(mutex_);
    Known* known = find(id);
    if (known == nullptr || !known->open) return false;
    known->newest = std::move(reply);
    send(id, *known->newest);
    return true;
  }

  /// Waits for the next reply to send and returns it; nothing once the queue is closed and all replies were
  /// returned.
  std::optional<Reply> next_reply() {
    std::unique_lock lock(mutex_);
    replied_.wait(lock, [this] { return closed_ || !replies_.empty(); });
    if (replies_.empty()) return std::nullopt;
    Reply reply = std::move(replies_.front());
    replies_.pop_front();
    return reply;
  }
  /// Closes the queue, so that next_reply() returns once no replies are left.
  void close() {
    const std::lock_guard lock(mutex_);
    closed_ = true;
    replied_.notify_all();
  }

 private:
  struct Known {
    core::SampleId id;
    std::optional<Reply> newest;
    bool open;  // has no final reply yet
  };

  Known* find(const core::SampleId& id) {
    const auto found = std::find_if(known_.rbegin(), known_.rend(), [&](const Known& known) {
      return known.id.session == id.session && known.id.sequence_number == id.sequence_number;
    });
    return found != known_.rend() ? &*found : nullptr;
  }
  std::optional<Command> take() {
    if (waiting_.empty()) return std::nullopt;
    Command command = std::move(waiting_.front());
    waiting_.pop_front();
    waiting_count_.store(waiting_.size(), std::memory_order_release);
    return command;
  }
  void send(const core::SampleId& id, Reply reply) {
    reply.command = id;
    replies_.push_back(std::move(reply));
    // A sender that misses a reply repeats its command.
    if (replies_.size() > kMaxReplies) replies_.pop_front();
    replied_.notify_one();
  }
  void forget_oldest() {
    if (known_.size() - open_ <= kMaxRemembered) return;
    const auto oldest =
        std::find_if(known_.begin(), known_.end(), [](const Known& known) { return !known.open; });
    const core::SampleId gone = oldest->id;
    known_.erase(oldest);
    const auto same =
        std::find_if(forgotten_.begin(), forgotten_.end(),
                     [&](const core::SampleId& forgotten) { return forgotten.session == gone.session; });
    if (same != forgotten_.end()) {
      same->sequence_number = std::max(same->sequence_number, gone.sequence_number);
    } else {
      forgotten_.push_back(gone);
      if (forgotten_.size() > kMaxRemembered) forgotten_.pop_front();
    }
  }
  /// Returns whether the command's reply was forgotten. A sender's numbers rise, so every number below a
  /// forgotten one is old too.
  bool was_forgotten(const core::SampleId& id) const {
    return std::any_of(forgotten_.begin(), forgotten_.end(), [&](const core::SampleId& forgotten) {
      return forgotten.session == id.session && id.sequence_number <= forgotten.sequence_number;
    });
  }

  const CommandRules<Command, Reply> rules_;
  std::mutex mutex_;
  std::condition_variable came_, replied_;
  std::deque<Command> waiting_;
  std::atomic<std::size_t> waiting_count_{0};
  std::deque<Known> known_;               // the newest last
  std::deque<core::SampleId> forgotten_;  // the newest forgotten command of each session
  std::deque<Reply> replies_;
  std::size_t open_ = 0;  // waiting or being carried out
  bool closed_ = false;
};

}  // namespace phantom::messages

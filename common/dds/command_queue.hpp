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

#include "common/dds/stamp.hpp"

namespace phantom::dds {

/// What a component has to say to the commands of one topic. What is left empty does not happen. All are
/// called on the thread that receives; none may call the queue.
template <class Command, class Reply>
struct CommandRules {
  /// Whether the command is for this component; others are passed over without a reply.
  std::function<bool(const Command&)> concerns = {};
  /// Why the command cannot be used, naming the field and what is allowed; empty: it can.
  std::function<std::string(const Command&)> refusal = {};
  /// The reply that refuses. Needed.
  std::function<Reply(const Command&, const std::string& why)> refused = {};
  /// A first reply to a command that was queued behind `before` others.
  std::function<Reply(const Command&, std::size_t before)> accepted = {};
};

/// Commands on their way from the thread that receives them to the one that carries them out, and replies on
/// their way back. Commands are known by their stamp (session and number): one that comes again, as its
/// sender heard no reply, is not carried out again; its newest reply is repeated. Bounded: beyond kMostOpen
/// commands that wait or are being carried out, the next is refused; beyond kMostRemembered, the replies to
/// the oldest that were answered are forgotten, and those commands are refused should they come again. Knows
/// no network. Thread-safe; nobody is kept waiting for longer than it takes to move a command or a reply.
/// Real-time safe: no, but next() takes no lock while nothing waits.
///
/// Command has stamp(); Reply has command(), the echo of it, which this fills.
template <class Command, class Reply>
class CommandQueue {
 public:
  static constexpr std::size_t kMostOpen = 64, kMostRemembered = 256, kMostReplies = 256;

  explicit CommandQueue(CommandRules<Command, Reply> rules) : rules_(std::move(rules)) {}

  /// Takes a command in, and gives the reply that is due at once, if any, to next_reply(). True if the
  /// command is new and waits to be carried out.
  bool receive(const Command& command) {
    if (rules_.concerns && !rules_.concerns(command)) return false;
    const core::SampleId id = id_of(command.stamp());
    std::string why;
    if (id.sequence_number == 0) {
      why = "stamp.sequence_number is 0; allowed: 1 or more";
    } else if (rules_.refusal) {
      why = rules_.refusal(command);
    }
    const std::lock_guard lock(mutex_);
    if (const Known* known = find(id)) {
      if (known->newest) send(id, *known->newest);
      return false;
    }
    if (why.empty() && was_forgotten(id))
      why = "stamp.sequence_number is one that was carried out long ago; allowed: a new one";
    if (why.empty() && open_ >= kMostOpen)
      why = std::to_string(open_) + " commands are waiting already; send it again later";
    if (!why.empty()) {
      send(id, rules_.refused(command, why));  // not remembered: it may be sent again when there is room
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

  /// The next command to be carried out, which then waits for complete(); none if nothing waits.
  std::optional<Command> next() {
    if (waiting_count_.load(std::memory_order_acquire) == 0) return std::nullopt;
    const std::lock_guard lock(mutex_);
    return take();
  }
  /// The same, waiting for one at most `wait_s`.
  std::optional<Command> next(double wait_s) {
    std::unique_lock lock(mutex_);
    came_.wait_for(lock, std::chrono::duration<double>(wait_s), [this] { return !waiting_.empty(); });
    return take();
  }

  /// Answers a command that next() gave, now or at any later time. False if it was answered before or was
  /// never given: that reply is dropped.
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

  /// The next reply to be sent, waiting for one. None once the queue was closed and all were given.
  std::optional<Reply> next_reply() {
    std::unique_lock lock(mutex_);
    replied_.wait(lock, [this] { return closed_ || !replies_.empty(); });
    if (replies_.empty()) return std::nullopt;
    Reply reply = std::move(replies_.front());
    replies_.pop_front();
    return reply;
  }
  /// Lets next_reply() end.
  void close() {
    const std::lock_guard lock(mutex_);
    closed_ = true;
    replied_.notify_all();
  }

 private:
  struct Known {
    core::SampleId id;
    std::optional<Reply> newest;
    bool open;  // not answered for good
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
    reply.command(echo_of(id));
    replies_.push_back(std::move(reply));
    if (replies_.size() > kMostReplies) replies_.pop_front();  // who misses it sends the command again
    replied_.notify_one();
  }
  void forget_oldest() {
    if (known_.size() - open_ <= kMostRemembered) return;
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
      if (forgotten_.size() > kMostRemembered) forgotten_.pop_front();
    }
  }
  /// A sender's numbers rise: what is below one that is forgotten is old, too.
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
  std::deque<core::SampleId> forgotten_;  // the newest of each session
  std::deque<Reply> replies_;
  std::size_t open_ = 0;  // waiting or being carried out
  bool closed_ = false;
};

}  // namespace phantom::dds

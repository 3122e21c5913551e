#pragma once

#include <functional>
#include <optional>
#include <thread>
#include <utility>

#include "common/core/thread_place.hpp"
#include "common/dds/command_queue.hpp"
#include "common/dds/endpoint.hpp"

namespace phantom::dds {

/// The server end of a pair of topics in which every Command is answered by Replies that echo its stamp
/// (workspace_command, sensing_command, operator_command). Requester is the client end. Commands pass through
/// a CommandQueue, whose rules and bounds apply. A thread of its own sends the replies: neither the
/// middleware's thread nor the thread that carries commands out waits while a reply is written.
///
///     if (const auto command = service.next())      … at once, or later, on any thread:
///       service.complete(id_of(command->stamp()), reply);
template <class Command, class Reply>
class CommandService {
 public:
  using Rules = CommandRules<Command, Reply>;

  /// `on_queued` is called on the middleware's thread when a new command waits, to wake the thread that
  /// carries it out. It must not block. Throws DdsError.
  CommandService(Participant& participant, const TopicSpec<Command>& commands,
                 const TopicSpec<Reply>& replies, Rules rules, std::function<void()> on_queued = {})
      : queue_(std::move(rules)),
        stamper_(participant),
        writer_(participant, replies),
        on_queued_(std::move(on_queued)),
        reader_(std::in_place, participant, commands,
                [this](const Command& command, const SampleInfo&) {
                  if (queue_.receive(command) && on_queued_) on_queued_();
                }),
        sender_([this, servo_priority = participant.servo_priority()] {
          core::take_place(core::ThreadRole::kReplies, servo_priority);
          send_replies();
        }) {}
  /// Sends the replies that are still queued, then ends.
  ~CommandService() {
    reader_.reset();
    queue_.close();
  }
  CommandService(const CommandService&) = delete;
  CommandService& operator=(const CommandService&) = delete;

  /// See CommandQueue.
  std::optional<Command> next() { return queue_.next(); }
  std::optional<Command> next(double wait_s) { return queue_.next(wait_s); }
  bool complete(const core::SampleId& id, Reply reply) { return queue_.complete(id, std::move(reply)); }

 private:
  void send_replies() {
    while (auto reply = queue_.next_reply()) {
      reply->stamp(stamper_.next());
      writer_.write(*reply);  // a requester that misses the reply repeats its command
    }
  }

  CommandQueue<Command, Reply> queue_;
  Stamper stamper_;
  Writer<Reply> writer_;
  std::function<void()> on_queued_;
  std::optional<Reader<Command>> reader_;
  std::jthread sender_;
};

}  // namespace phantom::dds

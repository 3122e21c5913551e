#pragma once

#include <functional>
#include <optional>
#include <thread>
#include <utility>

#include "common/core/status.hpp"
#include "common/core/thread_config.hpp"
#include "common/dds/endpoints/endpoint.hpp"
#include "common/messages/command_queue.hpp"
#include "common/messages/publisher.hpp"

namespace phantom::messages {

/// The server end of a pair of topics in which every Command is answered by Replies that echo its stamp
/// (workspace_command, sensing_command, operator_command). Requester is the client end. Commands pass through
/// a CommandQueue, whose rules and bounds apply. A thread of its own sends the replies: neither the
/// middleware's thread nor the thread that carries commands out waits while a reply is written.
///
///     if (const auto command = service.next())      … at once, or later, on any thread:
///       service.complete(command->stamp, reply);
///
/// Include the topics' codec, too.
template <class Command, class Reply>
class CommandService {
 public:
  using Rules = CommandRules<Command, Reply>;
  using CommandMessage = decltype(to_idl(std::declval<const Command&>()));

  /// `on_queued` is called on the middleware's thread when a new command waits, to wake the thread that
  /// carries it out. It must not block. Throws DdsError.
  CommandService(dds::Participant& participant, const dds::TopicSpec<CommandMessage>& commands,
                 const dds::TopicSpec<typename Publisher<Reply>::Message>& replies, Rules rules,
                 std::function<void()> on_queued = {})
      : queue_(std::move(rules)),
        replies_(participant, replies),
        on_queued_(std::move(on_queued)),
        reader_(std::in_place, participant, commands,
                [this](const CommandMessage& message, const dds::SampleInfo&) {
                  Command command;
                  const core::Status status = read(message, command);
                  if (queue_.receive(command, status.message()) && on_queued_) on_queued_();
                }),
        sender_([this, servo_priority = participant.servo_priority()] {
          core::apply_thread_config(core::ThreadRole::kReplies, servo_priority);
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
  bool notify(const core::SampleId& id, Reply reply) { return queue_.notify(id, std::move(reply)); }
  bool complete(const core::SampleId& id, Reply reply) { return queue_.complete(id, std::move(reply)); }

 private:
  void send_replies() {
    // A requester that misses a reply repeats its command.
    while (const auto reply = queue_.next_reply()) replies_.publish(*reply);
  }

  CommandQueue<Command, Reply> queue_;
  Publisher<Reply> replies_;
  std::function<void()> on_queued_;
  std::optional<dds::Reader<CommandMessage>> reader_;
  std::jthread sender_;
};

}  // namespace phantom::messages

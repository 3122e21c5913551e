#pragma once

#include <array>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>

#include "common/dds/endpoints/endpoint.hpp"
#include "common/dds/endpoints/stamp.hpp"
#include "common/messages/codecs/teleoperation_codec.hpp"
#include "common/teleop/commands/command_answers.hpp"

namespace phantom::messages {

/// The client end of operator_command and operator_reply: sends commands and records which sides have
/// answered. A command is repeated every kAgain_ns with the same stamp (its receiver carries it out once)
/// until every side that must answer has answered: a stop without a time limit, any other command for the
/// time that it is given. A newer command ends the repetition of older ones, so that none of them takes
/// effect after it; only a reset or a newer stop ends that of a stop. Thread-safe; a thread of its own
/// repeats the commands.
class OperatorClient {
 public:
  static constexpr core::Nanoseconds kAgain_ns = 50 * core::kNsPerMillisecond;
  /// A process counts as the side's own for this long after its last state sample.
  static constexpr core::Nanoseconds kBound_ns = core::kNsPerSecond;

  /// Called at every change of the answers to the last requested stop, while not all sides have confirmed it;
  /// called with nothing once they have, or once a reset was sent. Called with a lock held: copy and return,
  /// do not call the client.
  using OnStop = std::function<void(const std::optional<teleop::CommandAnswers>&)>;

  /// Throws DdsError.
  explicit OperatorClient(dds::Participant& participant, OnStop on_stop = nullptr);
  /// Ends all repetition, also of a stop that nobody has confirmed.
  ~OperatorClient();
  OperatorClient(const OperatorClient&) = delete;
  OperatorClient& operator=(const OperatorClient&) = delete;

  /// Stamps and sends `command`, and repeats it for `repeat_s` at most; a stop until it is confirmed. Returns
  /// its number, for wait(). May block for some milliseconds, as any write.
  std::uint64_t send(const OperatorCommand& command, double repeat_s);
  /// Waits until every side has answered (to a stop: has stopped), for `timeout_s` at most. Returns the
  /// answers so far.
  teleop::CommandAnswers wait(std::uint64_t number, double timeout_s);
  /// send(), then wait().
  teleop::CommandAnswers ask(const OperatorCommand& command, double timeout_s) {
    return wait(send(command, timeout_s), timeout_s);
  }

  /// Records a side's state. The caller's readers of master_state and slave_state call it for each sample of
  /// the source that they follow. `stop`: the stop in force there, 0 for none. From then on replies of
  /// another process do not count as this side's. Without such readers, every reply under the side's name
  /// counts.
  void take_state(teleop::Side side, std::uint64_t session, std::uint64_t stop,
                  core::Nanoseconds received_ns);

  /// Returns the answers to a requested stop that not all sides have confirmed; nothing if there is no such
  /// stop.
  std::optional<teleop::CommandAnswers> unconfirmed_stop() const;

 private:
  struct Request {
    std::uint64_t number = 0;
    msg::OperatorCommand command;  // stamped
    teleop::CommandAnswers answers;
    core::Nanoseconds sent_ns = 0, repeat_until_ns = 0;
    bool repeats = false;

    bool is_stop() const { return command.kind() == msg::CommandKind::COMMAND_EMERGENCY_STOP; }
    bool finished() const { return is_stop() ? answers.done() : answers.answered(); }
  };
  struct Source {
    std::uint64_t session = 0;
    core::Nanoseconds heard_ns = 0;  // 0: never
  };
  void take_reply(const OperatorReply& reply, core::Nanoseconds received_ns);
  void end_repeats_for(const Request& newer);
  void finish_if_done(Request& request);
  void publish_stop();
  Request* find(std::uint64_t number);
  const Request* unconfirmed() const;
  void forget_one();
  void repeat();

  static constexpr std::size_t kRemembered = 64;

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  dds::Stamper stamper_;
  OnStop on_stop_;
  std::deque<Request> requests_;  // newest last
  std::array<Source, teleop::kSides.size()> sources_{};
  std::array<std::uint64_t, teleop::kSides.size()> released_{};  // the stops that the last reset named
  bool ending_ = false;
  dds::Writer<msg::OperatorCommand> writer_;
  dds::Reader<msg::OperatorReply> replies_;
  std::thread thread_;
};

}  // namespace phantom::messages

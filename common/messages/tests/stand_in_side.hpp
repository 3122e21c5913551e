#pragma once

#include <atomic>
#include <mutex>
#include <string>
#include <vector>

#include "common/dds/endpoints/endpoint.hpp"
#include "common/dds/endpoints/stamp.hpp"
#include "common/messages/codecs/teleoperation_codec.hpp"
#include "common/teleop/commands/command_answers.hpp"

namespace phantom::messages {

/// Plays master_io or slave_io on operator_command and operator_reply for tests of who asks: keeps what it
/// heard, answers as it is told to. A stop that it answers is in force until a reset names it.
class StandInSide {
 public:
  StandInSide(dds::Participant& participant, teleop::Side side)
      : side_(side),
        stamper_(participant),
        replies_(participant, dds::kOperatorReply),
        commands_(participant, dds::kOperatorCommand,
                  [this](const msg::OperatorCommand& message, const dds::SampleInfo&) {
                    if (const auto command = from_idl(message)) take(*command);
                  }) {}

  std::atomic<bool> answers{true};  ///< false: hears, and keeps silent
  std::atomic<bool> refuses{false};
  std::atomic<std::uint64_t> stop{0};  ///< in force; 0: none

  /// All that was heard, repetitions included.
  std::vector<OperatorCommand> heard() const {
    const std::lock_guard lock(mutex_);
    return heard_;
  }
  std::size_t heard_of(teleop::CommandKind kind) const {
    std::size_t count = 0;
    for (const OperatorCommand& command : heard()) count += command.kind == kind ? 1 : 0;
    return count;
  }
  bool matched() const { return replies_.matched() > 0 && commands_.matched() > 0; }

 private:
  void take(const OperatorCommand& command) {
    const std::lock_guard lock(mutex_);
    heard_.push_back(command);
    if (!answers || !teleop::asks(command.kind, side_)) return;
    bool done = !refuses;
    if (done && command.kind == teleop::CommandKind::kEmergencyStop)
      stop = command.stamp.sequence_number + 1000;
    if (done && command.kind == teleop::CommandKind::kReset) {
      done = stop == (side_ == teleop::Side::kMaster ? command.master_stop : command.slave_stop);
      if (done) stop = 0;
    }
    msg::OperatorReply reply = to_idl(OperatorReply{.command = command.stamp,
                                                    .component = teleop::component_of(side_),
                                                    .kind = command.kind,
                                                    .done = done,
                                                    .message = done      ? "as asked"
                                                               : refuses ? "not now; allowed is later"
                                                                         : "another stop is in force"});
    reply.stamp(stamper_.next());
    replies_.write(reply);
  }

  teleop::Side side_;
  mutable std::mutex mutex_;
  std::vector<OperatorCommand> heard_;
  dds::Stamper stamper_;
  dds::Writer<msg::OperatorReply> replies_;
  dds::Reader<msg::OperatorCommand> commands_;
};

}  // namespace phantom::messages

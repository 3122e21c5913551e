#pragma once

#include <atomic>
#include <mutex>
#include <string>
#include <vector>

#include "common/core/command_answers.hpp"
#include "common/dds/endpoint.hpp"
#include "common/dds/stamp.hpp"

namespace phantom::dds {

/// Plays master_io or slave_io on operator_command and operator_reply for tests of who asks: keeps what it
/// heard, answers as it is told to. A stop that it answers is in force until a reset names it.
class StandInSide {
 public:
  StandInSide(Participant& participant, core::Side side)
      : side_(side),
        stamper_(participant),
        replies_(participant, kOperatorReply),
        commands_(participant, kOperatorCommand,
                  [this](const msg::OperatorCommand& command, const SampleInfo&) { take(command); }) {}

  std::atomic<bool> answers{true};  ///< false: hears, and keeps silent
  std::atomic<bool> refuses{false};
  std::atomic<std::uint64_t> stop{0};  ///< in force; 0: none

  /// All that was heard, repetitions included.
  std::vector<msg::OperatorCommand> heard() const {
    const std::lock_guard lock(mutex_);
    return heard_;
  }
  std::size_t heard_of(msg::CommandKind kind) const {
    std::size_t count = 0;
    for (const msg::OperatorCommand& command : heard()) count += command.kind() == kind ? 1 : 0;
    return count;
  }
  bool matched() const { return replies_.matched() > 0 && commands_.matched() > 0; }

 private:
  void take(const msg::OperatorCommand& command) {
    const std::lock_guard lock(mutex_);
    heard_.push_back(command);
    const bool both = command.kind() == msg::COMMAND_EMERGENCY_STOP || command.kind() == msg::COMMAND_RESET;
    const bool view = command.kind() == msg::COMMAND_VIEW_HOLD || command.kind() == msg::COMMAND_VIEW_NODE ||
                      command.kind() == msg::COMMAND_MARK;
    if (!answers || view || (!both && side_ == core::Side::kSlave)) return;
    bool done = !refuses;
    if (done && command.kind() == msg::COMMAND_EMERGENCY_STOP)
      stop = command.stamp().sequence_number() + 1000;
    if (done && command.kind() == msg::COMMAND_RESET) {
      done = stop == (side_ == core::Side::kMaster ? command.master_stop() : command.slave_stop());
      if (done) stop = 0;
    }
    msg::OperatorReply reply;
    reply.stamp(stamper_.next());
    reply.command(echo_of(id_of(command.stamp())));
    reply.component_name(core::component_of(side_));
    reply.kind(command.kind());
    reply.done(done);
    reply.message(done ? "as asked" : refuses ? "not now; allowed is later" : "another stop is in force");
    replies_.write(reply);
  }

  core::Side side_;
  mutable std::mutex mutex_;
  std::vector<msg::OperatorCommand> heard_;
  Stamper stamper_;
  Writer<msg::OperatorReply> replies_;
  Reader<msg::OperatorCommand> commands_;
};

}  // namespace phantom::dds

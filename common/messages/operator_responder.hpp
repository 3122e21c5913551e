#pragma once

#include <functional>
#include <memory>

#include "common/core/status.hpp"
#include "common/dds/endpoints/participant.hpp"
#include "common/messages/teleoperation.hpp"
#include "common/teleop/commands/command_answers.hpp"
#include "common/teleop/commands/stop_requests.hpp"

namespace phantom::messages {

/// The end of operator_command in master_io or slave_io: carries out the commands and answers on
/// operator_reply. A stop acts on the middleware's thread, before anything else. It is answered once the
/// servo reports that it is stopped, a reset once the servo has decided on it. Commands that this process
/// itself wrote on operator_command are ignored.
class OperatorResponder {
 public:
  /// Carries out a command that is neither stop nor reset, or refuses it with a message that names what is
  /// allowed. Called on the middleware's thread; must not block.
  using Settings = std::function<core::Status(const OperatorCommand&)>;

  /// `stops` must outlive this object. Without `settings`, it ignores commands other than stop and reset.
  /// Throws DdsError.
  OperatorResponder(dds::Participant& participant, teleop::Side side, teleop::StopRequests& stops,
                    Settings settings = {});
  ~OperatorResponder();

  /// Takes the servo's report: how many requests for a stop are in force, and whether it is stopped. Answers
  /// the commands that are due. Always from the same thread; cheap while nothing is due.
  void on_report(std::uint32_t stop_requests, bool stopped);
  /// Sends a command to everyone else; this process has carried out its own part already. Thread-safe.
  void announce(const OperatorCommand& command);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace phantom::messages

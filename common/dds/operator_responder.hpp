#pragma once

#include <functional>
#include <memory>
#include <string>

#include "common/core/command_answers.hpp"
#include "common/core/status.hpp"
#include "common/core/stop_requests.hpp"
#include "common/dds/participant.hpp"
#include "phantom_idl/teleoperation.h"

namespace phantom::dds {

/// The end of operator_command at which master_io or slave_io carries out what is asked, and answers on
/// operator_reply. A stop acts on the middleware's thread, before anything else; it is answered once the
/// servo says that it is stopped, a reset once the servo has judged it. What this process itself has written
/// on operator_command is passed over.
class OperatorResponder {
 public:
  /// Carries out a command that is neither stop nor reset, or refuses it with a message that names what is
  /// allowed. Called on the middleware's thread; must not block.
  using Settings = std::function<core::Status(const msg::OperatorCommand&)>;

  /// `stops` must outlive it. Without `settings`, commands other than stop and reset are somebody else's.
  /// Throws DdsError.
  OperatorResponder(Participant& participant, core::Side side, core::StopRequests& stops,
                    Settings settings = {});
  ~OperatorResponder();

  /// What the servo has reported: how many requests for a stop are in force, and whether it is stopped.
  /// Answers what is due. One thread; cheap while nothing is due.
  void on_report(std::uint32_t stop_requests, bool stopped);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace phantom::dds

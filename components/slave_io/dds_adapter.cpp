#include "components/slave_io/dds_adapter.hpp"

#include <spdlog/spdlog.h>

#include "common/dds/participant.hpp"
#include "common/messages/checked_reader.hpp"
#include "common/messages/operator_responder.hpp"
#include "common/messages/publisher.hpp"
#include "common/messages/status_reporter.hpp"
#include "common/messages/teleoperation_codec.hpp"

namespace phantom::slave_io {

core::Status HomingRequest::ask() {
  switch (state_.load(std::memory_order_acquire)) {
    case State::kNotNeeded:
      return core::Status::invalid_argument("home: no drive has to be homed");
    case State::kNotYet:
      return core::Status::invalid_argument(
          "home: the drives are not ready yet; allowed: once slave_io names who has to be homed");
    case State::kStopped:
      return core::Status::invalid_argument("home: the arm is stopped; allowed: after a reset");
    case State::kWithheld:
      return core::Status::invalid_argument(
          "home: an enabling switch is released; allowed: while it is held");
    case State::kRuns:
      return core::Status::invalid_argument("home: the drives are being homed already");
    case State::kPossible:
      break;
  }
  requested_.store(true, std::memory_order_release);
  return core::Status::ok();
}

struct DdsAdapter::Impl {
  Impl(const core::NetworkOptions& network, const messages::ArmBounds& arm, Inbox& inbox)
      : participant("slave_io", network),
        status(participant),
        slave(participant, dds::kSlaveState),
        master(participant, dds::kMasterState, arm,
               [this, &inbox](const messages::MasterState& state, core::Nanoseconds received_ns) {
                 inbox.master.write({state, state.slave_echo, received_ns, participant.session()});
               }),
        responder(participant, core::Side::kSlave, inbox.stops,
                  [&inbox](const messages::OperatorCommand& command) { return homing(command, inbox); }) {}

  static core::Status homing(const messages::OperatorCommand& command, Inbox& inbox) {
    const core::Status status = inbox.homing.ask();
    if (status) spdlog::info("homing of the drives begins, asked for by {}", command.issuer);
    return status;
  }

  dds::Participant participant;
  messages::StatusReporter status;
  messages::Publisher<messages::SlaveState> slave;
  messages::CheckedReader<msg::MasterState> master;
  messages::OperatorResponder responder;
};

DdsAdapter::DdsAdapter(const core::NetworkOptions& network, const messages::ArmBounds& arm, Inbox& inbox)
    : impl_(std::make_unique<Impl>(network, arm, inbox)) {}
DdsAdapter::~DdsAdapter() = default;

void DdsAdapter::publish(const SlaveReport& report) {
  impl_->slave.publish(report);
  impl_->responder.on_report(report.stop_requests, report.outputs.stop.id != 0);
}

void DdsAdapter::announce_stop(const std::string& issuer) {
  spdlog::warn("emergency stop by {}", issuer);
  impl_->responder.announce({.kind = core::CommandKind::kEmergencyStop, .issuer = issuer});
}

void DdsAdapter::publish_health(const core::Health& health) {
  const bool rival = impl_->master.has_rival(core::monotonic_ns());
  impl_->status.publish(rival ? dds::with_rival(health, "master_state") : health);
}

}  // namespace phantom::slave_io

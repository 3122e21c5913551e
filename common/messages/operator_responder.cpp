#include "common/messages/operator_responder.hpp"

#include <spdlog/spdlog.h>

#include <atomic>
#include <mutex>
#include <vector>

#include "common/core/clock.hpp"
#include "common/dds/endpoints/topics.hpp"
#include "common/messages/codecs/teleoperation_codec.hpp"
#include "common/messages/command_service.hpp"
#include "common/messages/request_log.hpp"

namespace phantom::messages {
namespace {

using teleop::CommandKind;

/// A command that the servo has not answered yet.
struct Waiting {
  OperatorCommand command;
  std::uint32_t number;  // number of the stop request, or of the reset
};

}  // namespace

struct OperatorResponder::Impl {
  Impl(dds::Participant& participant, teleop::Side side_of, teleop::StopRequests& requests, Settings others)
      : side(side_of),
        stops(requests),
        settings(std::move(others)),
        own_session(participant.session()),
        own_commands(participant, dds::kOperatorCommand),
        service(participant, dds::kOperatorCommand, dds::kOperatorReply, rules(), [this] { carry_out(); }) {}

  CommandRules<OperatorCommand, OperatorReply> rules() {
    return {.concerns =
                [this](const OperatorCommand& command) {
                  return command.stamp.session != own_session && teleop::asks(command.kind, side);
                },
            .refused = [this](const OperatorCommand& command,
                              const std::string& why) { return reply(command, false, why); }};
  }

  OperatorReply reply(const OperatorCommand& command, bool done, const std::string& message) const {
    return {.component = teleop::component_of(side), .kind = command.kind, .done = done, .message = message};
  }
  void complete(const OperatorCommand& command, bool done, const std::string& message) {
    service.complete(command.stamp, reply(command, done, message));
  }

  void carry_out() {
    while (const auto command = service.next()) carry_out(*command);
  }

  void carry_out(const OperatorCommand& command) {
    if (command.kind == CommandKind::kEmergencyStop) {
      wait_for({command, stops.stop()});
      return log_request(stop_rate, spdlog::level::warn, "emergency stop", command);
    }
    if (command.kind == CommandKind::kReset) return reset(command);
    const core::Status status = settings(command);
    complete(command, status.is_ok(), status.is_ok() ? "done" : status.message());
  }

  void reset(const OperatorCommand& command) {
    const bool master = side == teleop::Side::kMaster;
    const std::uint32_t number = stops.reset({.own = master ? command.master_stop : command.slave_stop,
                                              .partner = master ? command.slave_stop : command.master_stop});
    if (number == 0) {
      complete(command, false, "too many resets are waiting; send it again later");
    } else {
      wait_for({command, number});
    }
    log_request(reset_rate, spdlog::level::info, "reset", command);
  }

  // At a rate of its own for each kind, so that a flood of one does not hide the other.
  void log_request(core::LogRate& rate, spdlog::level::level_enum level, const char* what,
                   const OperatorCommand& command) {
    if (is_logged(rate, what)) spdlog::log(level, "{} by {}", what, command.issuer);
  }

  void wait_for(const Waiting& command) {
    const std::lock_guard lock(mutex);
    waiting.push_back(command);
    any_waits.store(true, std::memory_order_release);
  }

  /// Completes the waiting commands of a kind for which `answers` returns true.
  template <class Answers>
  void complete_where(CommandKind kind, bool done, const std::string& message, Answers answers) {
    const std::lock_guard lock(mutex);
    std::erase_if(waiting, [&](const Waiting& each) {
      const bool due = each.command.kind == kind && answers(each.number);
      if (due) complete(each.command, done, message);
      return due;
    });
    any_waits.store(!waiting.empty(), std::memory_order_release);
  }

  void on_report(std::uint32_t stop_requests, bool stopped) {
    if (!any_waits.load(std::memory_order_acquire)) return;
    teleop::StopRequests::Result result;
    while (stops.take_result(result)) {
      complete_where(CommandKind::kReset, result.released,
                     result.released ? "released"
                                     : "another stop is in force than the one that the reset names; "
                                       "look at it, then reset it",
                     [&](std::uint32_t number) { return number == result.number; });
    }
    complete_where(
        CommandKind::kEmergencyStop, true, stopped ? "stopped" : "was stopped, and has been released since",
        // Counters wrap, so compare them by their difference.
        [&](std::uint32_t number) { return static_cast<std::int32_t>(stop_requests - number) >= 0; });
  }

  void announce(const OperatorCommand& command) {
    const std::lock_guard lock(own_mutex);
    own_commands.publish(command);
  }

  const teleop::Side side;
  teleop::StopRequests& stops;
  const Settings settings;
  const std::uint64_t own_session;
  core::LogRate stop_rate, reset_rate;
  std::mutex mutex;  // guards `waiting`
  std::vector<Waiting> waiting;
  std::atomic<bool> any_waits{false};
  std::mutex own_mutex;  // guards `own_commands`
  Publisher<OperatorCommand> own_commands;
  CommandService<OperatorCommand, OperatorReply> service;  // last, because it calls back as soon as it exists
};

OperatorResponder::OperatorResponder(dds::Participant& participant, teleop::Side side,
                                     teleop::StopRequests& stops, Settings settings)
    : impl_(std::make_unique<Impl>(participant, side, stops, std::move(settings))) {}
OperatorResponder::~OperatorResponder() = default;

void OperatorResponder::on_report(std::uint32_t stop_requests, bool stopped) {
  impl_->on_report(stop_requests, stopped);
}
void OperatorResponder::announce(const OperatorCommand& command) { impl_->announce(command); }

}  // namespace phantom::messages

#include "common/dds/operator_responder.hpp"

#include <spdlog/spdlog.h>

#include <atomic>
#include <cmath>
#include <mutex>
#include <vector>

#include "common/dds/command_service.hpp"
#include "common/dds/topics.hpp"

namespace phantom::dds {
namespace {

using Command = msg::OperatorCommand;
using Reply = msg::OperatorReply;

constexpr std::size_t kMostMessage = 256;

std::string refusal(const Command& command) {
  if (command.kind() > msg::COMMAND_MARK) return "kind is not known; allowed: those of CommandKind";
  if (!std::isfinite(command.value())) return "value is not a finite number";
  return "";
}

/// A command that the servo has not answered yet.
struct Waiting {
  core::SampleId id;
  msg::CommandKind kind;
  std::uint32_t number;  // number of the stop request, or of the reset
};

}  // namespace

struct OperatorResponder::Impl {
  Impl(Participant& participant, core::Side side_of, core::StopRequests& requests, Settings others)
      : side(side_of),
        stops(requests),
        settings(std::move(others)),
        own_session(participant.session()),
        service(participant, kOperatorCommand, kOperatorReply, rules(), [this] { carry_out(); }) {}

  CommandRules<Command, Reply> rules() {
    return {.concerns = [this](const Command& command) { return concerns(command); },
            .refusal = refusal,
            .refused = [this](const Command& command,
                              const std::string& why) { return reply(command.kind(), false, why); }};
  }

  bool concerns(const Command& command) const {
    if (command.stamp().session() == own_session) return false;
    switch (command.kind()) {
      case msg::COMMAND_EMERGENCY_STOP:
      case msg::COMMAND_RESET:
        return true;
      case msg::COMMAND_VIEW_HOLD:
      case msg::COMMAND_VIEW_NODE:
      case msg::COMMAND_MARK:
        return false;
      default:
        return settings != nullptr;
    }
  }

  Reply reply(msg::CommandKind kind, bool done, const std::string& message) const {
    Reply made;
    made.component_name(core::component_of(side));
    made.kind(kind);
    made.done(done);
    made.message(message.substr(0, kMostMessage));
    return made;
  }

  void carry_out() {
    while (const auto command = service.next()) carry_out(*command);
  }

  void carry_out(const Command& command) {
    const core::SampleId id = id_of(command.stamp());
    const std::string issuer = command.issuer().to_string();
    if (command.kind() == msg::COMMAND_EMERGENCY_STOP) {
      wait_for({id, command.kind(), stops.stop()});
      return spdlog::warn("emergency stop by {}", issuer);
    }
    if (command.kind() == msg::COMMAND_RESET) return reset(command, id, issuer);
    const core::Status status = settings(command);
    service.complete(id, reply(command.kind(), status.is_ok(), status.is_ok() ? "done" : status.message()));
  }

  void reset(const Command& command, const core::SampleId& id, const std::string& issuer) {
    const bool master = side == core::Side::kMaster;
    const std::uint32_t number =
        stops.reset({.own = master ? command.master_stop() : command.slave_stop(),
                     .partner = master ? command.slave_stop() : command.master_stop()});
    if (number == 0) {
      service.complete(id, reply(command.kind(), false, "too many resets are waiting; send it again later"));
    } else {
      wait_for({id, command.kind(), number});
    }
    spdlog::info("reset by {}", issuer);
  }

  void wait_for(const Waiting& command) {
    const std::lock_guard lock(mutex);
    waiting.push_back(command);
    any_waits.store(true, std::memory_order_release);
  }

  template <class Answers>
  void complete_where(Answers answers) {
    const std::lock_guard lock(mutex);
    std::erase_if(waiting, [&](const Waiting& command) {
      const std::optional<Reply> due = answers(command);
      if (due) service.complete(command.id, *due);
      return due.has_value();
    });
    any_waits.store(!waiting.empty(), std::memory_order_release);
  }

  void on_result(const core::StopRequests::Result& result) {
    complete_where([&](const Waiting& command) -> std::optional<Reply> {
      if (command.kind != msg::COMMAND_RESET || command.number != result.number) return std::nullopt;
      return result.released ? reply(command.kind, true, "released")
                             : reply(command.kind, false,
                                     "another stop is in force than the one that the reset names; "
                                     "look at it, then reset it");
    });
  }

  void on_report(std::uint32_t stop_requests, bool stopped) {
    if (!any_waits.load(std::memory_order_acquire)) return;
    core::StopRequests::Result result;
    while (stops.take_result(result)) on_result(result);
    complete_where([&](const Waiting& command) -> std::optional<Reply> {
      // Counters wrap, so compare them by their difference.
      const bool in_force = static_cast<std::int32_t>(stop_requests - command.number) >= 0;
      if (command.kind != msg::COMMAND_EMERGENCY_STOP || !in_force) return std::nullopt;
      return reply(command.kind, true, stopped ? "stopped" : "was stopped, and has been released since");
    });
  }

  const core::Side side;
  core::StopRequests& stops;
  const Settings settings;
  const std::uint64_t own_session;
  std::mutex mutex;  // guards `waiting`
  std::vector<Waiting> waiting;
  std::atomic<bool> any_waits{false};
  CommandService<Command, Reply> service;  // last, because it calls back as soon as it is constructed
};

OperatorResponder::OperatorResponder(Participant& participant, core::Side side, core::StopRequests& stops,
                                     Settings settings)
    : impl_(std::make_unique<Impl>(participant, side, stops, std::move(settings))) {}
OperatorResponder::~OperatorResponder() = default;

void OperatorResponder::on_report(std::uint32_t stop_requests, bool stopped) {
  impl_->on_report(stop_requests, stopped);
}

}  // namespace phantom::dds

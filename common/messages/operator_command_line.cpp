#include "common/messages/operator_command_line.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <ostream>

#include "common/dds/endpoints/topics.hpp"
#include "common/messages/operator_client.hpp"
#include "common/messages/requester.hpp"

namespace phantom::messages {
namespace {

using teleop::CommandKind;
using teleop::OperatorOutcome;
using teleop::OperatorRequest;
using teleop::Side;

constexpr double kFind_s = 2.0;  // joining a busy site takes a second

/// The newest state that a side has reported.
struct SideState {
  teleop::LinkState state;
  teleop::StopRecord stop;
};

class CommandLine {
 public:
  CommandLine(const core::NetworkOptions& network, std::ostream& print)
      : print_(print),
        participant_("operator_command_line", network),
        client_(participant_),
        master_(participant_, dds::kMasterState,
                [this](const msg::MasterState& message, const dds::SampleInfo& info) {
                  on_state(Side::kMaster, message, info);
                }),
        slave_(participant_, dds::kSlaveState,
               [this](const msg::SlaveState& message, const dds::SampleInfo& info) {
                 on_state(Side::kSlave, message, info);
               }) {}

  OperatorOutcome run(const OperatorRequest& request, const std::string& issuer) {
    const bool stop = request.kind == CommandKind::kEmergencyStop,
               reset = request.kind == CommandKind::kReset;
    if (!stop)  // a stop is sent at once
      find_sides(reset ? std::max(kFind_s, request.timeout_s) : kFind_s);
    if (!request.kind) return print_status();
    OperatorCommand command{
        .kind = *request.kind, .value = request.value, .joint = request.joint, .issuer = issuer};
    if (reset) name_stops(command);
    if (request.gripper_force_N) {
      OperatorCommand force{
          .kind = CommandKind::kGripperForce, .value = *request.gripper_force_N, .issuer = issuer};
      const teleop::CommandAnswers answers = client_.ask(force, request.timeout_s);
      if (!answers.done()) return outcome(answers, command_words(answers));
    }
    const std::uint64_t number = client_.send(command, request.timeout_s);
    if (stop) {
      constexpr double kOverdue_s = core::seconds(teleop::CommandAnswers::kOverdue_ns);
      if (const auto soon = client_.wait(number, kOverdue_s); !soon.done())
        print_ << stop_words(soon) << " within " << kOverdue_s << " s; asking again\n" << std::flush;
    }
    const teleop::CommandAnswers answers = client_.wait(number, request.timeout_s);
    return outcome(answers, stop ? stop_words(answers) : command_words(answers));
  }

 private:
  void on_state(Side side, const auto& message, const dds::SampleInfo& info) {
    const auto sample = from_idl(message);
    if (!sample) return;
    client_.take_state(side, sample->stamp.session, sample->stop.id, info.received_ns);
    const std::lock_guard lock(mutex_);
    sides_[static_cast<std::size_t>(side)] = {sample->state, sample->stop};
    changed_.notify_all();
  }
  std::optional<SideState> state_of(Side side) {
    const std::lock_guard lock(mutex_);
    return sides_[static_cast<std::size_t>(side)];
  }
  void find_sides(double at_most_s) {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, std::chrono::duration<double>(at_most_s),
                      [this] { return sides_[0].has_value() && sides_[1].has_value(); });
  }
  // A side that is not heard keeps its stop, because its id is unknown.
  void name_stops(OperatorCommand& command) {
    for (const Side side : teleop::kSides) {
      const auto now = state_of(side);
      if (!now) print_ << component_of(side) << ": no state received; its stop is not named\n";
      (side == Side::kMaster ? command.master_stop : command.slave_stop) = now ? now->stop.id : 0;
    }
  }
  OperatorOutcome print_status() {
    bool any = false;
    for (const Side side : teleop::kSides) {
      const auto now = state_of(side);
      any = any || now;
      print_ << component_of(side) << ": " << (now ? teleop::name_of(now->state) : "not heard");
      if (now && now->stop.id != 0)
        print_ << " (" << name_of(now->stop.cause) << "; stop " << std::hex << now->stop.id << std::dec
               << ")";
      print_ << '\n';
    }
    return any ? OperatorOutcome::kDone : OperatorOutcome::kNobody;
  }
  OperatorOutcome outcome(const teleop::CommandAnswers& answers, const std::string& words) {
    print_ << words << '\n';
    if (answers.done()) return OperatorOutcome::kDone;
    return silent(answers) ? OperatorOutcome::kNobody : OperatorOutcome::kNotDone;
  }
  static bool silent(const teleop::CommandAnswers& answers) {
    bool none = true;
    for (const Side side : teleop::kSides) {
      const auto state = answers.of(side).state;
      none = none &&
             (state == teleop::SideAnswer::State::kWaiting || state == teleop::SideAnswer::State::kNotAsked);
    }
    return none;
  }

  std::ostream& print_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::array<std::optional<SideState>, teleop::kSides.size()> sides_{};
  dds::Participant participant_;
  OperatorClient client_;
  dds::Reader<msg::MasterState> master_;
  dds::Reader<msg::SlaveState> slave_;
};

}  // namespace

OperatorOutcome run_operator_request(const core::NetworkOptions& network, const std::string& issuer,
                                     const OperatorRequest& request, std::ostream& print) {
  return CommandLine(network, print).run(request, requester_name(issuer));
}

}  // namespace phantom::messages

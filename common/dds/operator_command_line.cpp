#include "common/dds/operator_command_line.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <ostream>

#include "common/dds/operator_client.hpp"
#include "common/dds/requester.hpp"
#include "common/dds/topics.hpp"

namespace phantom::dds {
namespace {

using core::OperatorOutcome;
using core::OperatorRequest;
using core::Side;
using What = OperatorRequest::What;

constexpr double kFind_s = 2.0;  // joining a busy site takes a second
constexpr const char* kStateNames[] = {"init", "ready", "aligned", "coupled", "degraded", "stopped"};

/// The newest state that a side has reported.
struct SideState {
  bool heard = false;
  std::uint32_t state = 0, cause = 0;
  std::uint64_t stop = 0;
};

msg::OperatorCommand command_for(const OperatorRequest& request, const std::string& issuer) {
  msg::OperatorCommand command;
  command.kind(request.what == What::kStop           ? msg::COMMAND_EMERGENCY_STOP
               : request.what == What::kReset        ? msg::COMMAND_RESET
               : request.what == What::kPerceptGain  ? msg::COMMAND_SET_PERCEPT_GAIN
               : request.what == What::kFeedbackGain ? msg::COMMAND_SET_FEEDBACK_GAIN
               : request.what == What::kLaw          ? msg::COMMAND_SET_LAW
                                                     : msg::COMMAND_ENABLE_PERCEPT);
  command.value(request.value);
  command.joint(request.joint);
  command.issuer(issuer.substr(0, 64));
  return command;
}

class CommandLine {
 public:
  CommandLine(const core::NetworkOptions& network, std::ostream& print)
      : print_(print),
        participant_("operator_command_line", network),
        client_(participant_),
        master_(participant_, kMasterState,
                [this](const msg::MasterState& sample, const SampleInfo& info) {
                  on_state(Side::kMaster, sample, info);
                }),
        slave_(participant_, kSlaveState, [this](const msg::SlaveState& sample, const SampleInfo& info) {
          on_state(Side::kSlave, sample, info);
        }) {}

  OperatorOutcome run(const OperatorRequest& request, const std::string& issuer) {
    const bool names_stops = request.what == What::kReset;
    if (request.what != What::kStop)  // a stop is sent at once
      find_sides(names_stops ? std::max(kFind_s, request.timeout_s) : kFind_s);
    if (request.what == What::kStatus) return print_status();
    msg::OperatorCommand command = command_for(request, issuer);
    if (names_stops) name_stops(command);
    const std::uint64_t number = client_.send(command, request.timeout_s);
    if (request.what == What::kStop) {
      constexpr double kOverdue_s = core::seconds(core::CommandAnswers::kOverdue_ns);
      if (const auto soon = client_.wait(number, kOverdue_s); !soon.done())
        print_ << stop_words(soon) << " within " << kOverdue_s << " s; asking again\n" << std::flush;
    }
    const core::CommandAnswers answers = client_.wait(number, request.timeout_s);
    print_ << (request.what == What::kStop ? stop_words(answers) : command_words(answers)) << '\n';
    if (answers.done()) return OperatorOutcome::kDone;
    return silent(answers) ? OperatorOutcome::kNobody : OperatorOutcome::kNotDone;
  }

 private:
  template <class State>
  void on_state(Side side, const State& sample, const SampleInfo& info) {
    client_.take_state(side, sample.stamp().session(), sample.stop(), info.received_ns);
    const std::lock_guard lock(mutex_);
    sides_[static_cast<std::size_t>(side)] = {true, static_cast<std::uint32_t>(sample.state()),
                                              static_cast<std::uint32_t>(sample.stop_cause()), sample.stop()};
    changed_.notify_all();
  }
  SideState state_of(Side side) {
    const std::lock_guard lock(mutex_);
    return sides_[static_cast<std::size_t>(side)];
  }
  void find_sides(double at_most_s) {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, std::chrono::duration<double>(at_most_s),
                      [this] { return sides_[0].heard && sides_[1].heard; });
  }
  // A side that is not heard keeps its stop, because its id is unknown.
  void name_stops(msg::OperatorCommand& command) {
    for (const Side side : core::kSides)
      if (!state_of(side).heard) print_ << component_of(side) << ": not heard; its stop is not named\n";
    command.master_stop(state_of(Side::kMaster).stop);
    command.slave_stop(state_of(Side::kSlave).stop);
  }
  OperatorOutcome print_status() {
    bool any = false;
    for (const Side side : core::kSides) {
      const SideState now = state_of(side);
      print_ << component_of(side) << ": ";
      if (!now.heard || now.state >= std::size(kStateNames)) {
        print_ << "not heard\n";
        continue;
      }
      any = true;
      print_ << kStateNames[now.state];
      if (now.stop != 0)
        print_ << " (" << name_of(static_cast<core::StopCause>(now.cause)) << "; stop " << std::hex
               << now.stop << std::dec << ")";
      print_ << '\n';
    }
    return any ? OperatorOutcome::kDone : OperatorOutcome::kNobody;
  }
  static bool silent(const core::CommandAnswers& answers) {
    bool none = true;
    for (const Side side : core::kSides) {
      const auto state = answers.of(side).state;
      none =
          none && (state == core::SideAnswer::State::kWaiting || state == core::SideAnswer::State::kNotAsked);
    }
    return none;
  }

  std::ostream& print_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::array<SideState, core::kSides.size()> sides_{};
  Participant participant_;
  OperatorClient client_;
  Reader<msg::MasterState> master_;
  Reader<msg::SlaveState> slave_;
};

}  // namespace

OperatorOutcome run_operator_request(const core::NetworkOptions& network, const std::string& issuer,
                                     const OperatorRequest& request, std::ostream& print) {
  return CommandLine(network, print).run(request, requester_name(issuer));
}

}  // namespace phantom::dds

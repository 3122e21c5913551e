// A person's commands, one a line of standard input, sent at once by one participant that stays; what it
// hears of both sides. It sends what it is told to, also what is wrong: resets that name other stops, say.
//
//   stop                     an emergency stop
//   reset MASTER SLAVE       that names these stops
//   law N | percept 0 or 1 | percept_gain G | feedback_gain 1/A
//   look                     nothing is sent
// To each line it answers with one of JSON: the command's kind, when it was sent (CLOCK_MONOTONIC, ns), and
// of master and slave the newest state: {"state", "stop", "session", "age_s"}.
#include <array>
#include <iostream>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <sstream>

#include "common/core/clock.hpp"
#include "common/dds/endpoints/endpoint.hpp"
#include "common/dds/endpoints/stamp.hpp"
#include "common/runtime/configuration/deployment.hpp"
#include "common/runtime/process/process.hpp"

namespace {

using namespace phantom;

struct Side {
  std::uint32_t state = 0;
  std::uint64_t stop = 0, session = 0;
  core::Nanoseconds received_ns = 0;
};

class Sides {
 public:
  template <class State>
  void take(std::size_t side, const State& sample, const dds::SampleInfo& info) {
    const std::lock_guard lock(mutex_);
    sides_[side] = {static_cast<std::uint32_t>(sample.state()), sample.stop(), sample.stamp().session(),
                    info.received_ns};
  }
  nlohmann::json shown() const {
    const std::lock_guard lock(mutex_);
    nlohmann::json json;
    for (std::size_t i = 0; i < sides_.size(); ++i) {
      const Side& s = sides_[i];
      const double age_s = s.received_ns == 0 ? -1.0 : core::seconds(core::monotonic_ns() - s.received_ns);
      json[i == 0 ? "master" : "slave"] = {
          {"state", s.state}, {"stop", s.stop}, {"session", s.session}, {"age_s", age_s}};
    }
    return json;
  }

 private:
  mutable std::mutex mutex_;
  std::array<Side, 2> sides_;
};

// Returns false if `line` is no command.
bool read_command(const std::string& line, msg::OperatorCommand& command) {
  const std::map<std::string, msg::CommandKind> kinds{
      {"stop", msg::CommandKind::COMMAND_EMERGENCY_STOP},
      {"reset", msg::CommandKind::COMMAND_RESET},
      {"law", msg::CommandKind::COMMAND_SET_LAW},
      {"percept", msg::CommandKind::COMMAND_ENABLE_PERCEPT},
      {"percept_gain", msg::CommandKind::COMMAND_SET_PERCEPT_GAIN},
      {"feedback_gain", msg::CommandKind::COMMAND_SET_FEEDBACK_GAIN}};
  std::istringstream words(line);
  std::string word;
  words >> word;
  const auto kind = kinds.find(word);
  if (kind == kinds.end()) return false;
  command.kind(kind->second);
  command.joint(-1);
  command.issuer("chaos");
  if (word == "reset") {
    std::uint64_t master = 0, slave = 0;
    if (!(words >> master >> slave)) return false;
    command.master_stop(master);
    command.slave_stop(slave);
  } else if (word != "stop") {
    double value = 0.0;
    if (!(words >> value)) return false;
    command.value(value);
  }
  return true;
}

}  // namespace

int main(int argc, char** argv) {
  runtime::ProcessDescription description;
  description.name = "commander";
  description.summary = "Sends an operator's commands, one a line, and shows how both sides are.";
  description.run = [&](const runtime::ProcessOptions& options) {
    const auto deployment = runtime::load_deployment(options);
    dds::Participant participant("operator_command_line", deployment.network);
    dds::Stamper stamper(participant);
    Sides sides;
    dds::Writer<msg::OperatorCommand> commands(participant, dds::kOperatorCommand);
    const dds::Reader<msg::MasterState> masters(
        participant, dds::kMasterState,
        [&](const auto& sample, const auto& info) { sides.take(0, sample, info); });
    const dds::Reader<msg::SlaveState> slaves(
        participant, dds::kSlaveState,
        [&](const auto& sample, const auto& info) { sides.take(1, sample, info); });
    for (std::string line; std::getline(std::cin, line);) {
      nlohmann::json answer;
      msg::OperatorCommand command;
      if (read_command(line, command)) {
        command.stamp(stamper.next());
        answer["sent"] = commands.write(command);
        answer["listeners"] = commands.matched();
      } else if (line != "look") {
        answer["unknown"] = line;
      }
      answer["line"] = line;
      answer["monotonic_ns"] = core::monotonic_ns();
      answer.update(sides.shown());
      std::cout << answer.dump() << std::endl;
    }
    return static_cast<int>(runtime::kExitDone);
  };
  return runtime::process_main(argc, argv, description);
}

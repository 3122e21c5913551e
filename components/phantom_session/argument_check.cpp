#include "components/phantom_session/argument_check.hpp"

#include <sys/mman.h>
#include <unistd.h>

#include <fstream>
#include <optional>
#include <ostream>
#include <set>
#include <stdexcept>

#include "common/core/errors.hpp"
#include "common/runtime/process/process.hpp"
#include "components/phantom_session/supervisor.hpp"

namespace phantom::phantom_session {
namespace {

constexpr double kPoll_s = 0.02;

/// What a component's `--check` has said and ended with.
struct Outcome {
  std::vector<std::string> lines;
  int code = 0;
};

/// Runs it; none if a stop was requested meanwhile.
std::optional<Outcome> run_check(const PlannedProcess& planned, const std::filesystem::path& bin) {
  const int memory = memfd_create("output", MFD_CLOEXEC);
  const std::filesystem::path output = "/proc/self/fd/" + std::to_string(memory);
  ProcessSpec spec{planned.process.name, bin / planned.process.component, {"--check"}, 0, output};
  spec.arguments.insert(spec.arguments.end(), planned.arguments.begin(), planned.arguments.end());
  Supervisor supervisor;
  std::vector<ProcessOutcome> ended;
  std::optional<Outcome> checked;
  try {
    supervisor.start(spec);
    while (ended.empty() && runtime::sleep_unless_stopped(kPoll_s)) ended = supervisor.newly_dead();
    if (!ended.empty()) {
      checked.emplace().code = *ended.front().exit_code;
      std::ifstream said(output);
      for (std::string line; std::getline(said, line);)
        if (!line.empty()) checked->lines.push_back(line);
    }
  } catch (...) {
    close(memory);
    throw;
  }
  close(memory);
  return checked;
}

/// Returns the line that says what is wrong: the last one that does not mention --help, without the
/// component's name.
std::string reason(const Outcome& checked, const std::string& component) {
  std::string last;
  for (const std::string& line : checked.lines)
    if (line.find("--help") == std::string::npos) last = line;
  return last.starts_with(component + ": ") ? last.substr(component.size() + 2) : last;
}

[[noreturn]] void fail(int code, const std::string& said) {
  if (code == runtime::kExitUsage) throw core::ConfigError(said);
  if (code == runtime::kExitMissing) throw core::MissingError(said);
  throw std::runtime_error(said + " (its --check ended with code " + std::to_string(code) + ")");
}

}  // namespace

void check_arguments(const std::vector<PlannedProcess>& planned, const std::filesystem::path& bin) {
  for (const PlannedProcess& each : planned) {
    if (!each.own_arguments) continue;
    const auto checked = run_check(each, bin);
    if (!checked) return;
    if (checked->code != runtime::kExitDone)
      fail(checked->code, each.process.name + ": " + reason(*checked, each.process.component));
  }
}

void check_all(const std::vector<PlannedProcess>& planned, const std::filesystem::path& bin,
               std::ostream& out, Checked where) {
  std::set<std::string> said;
  std::string refused;
  int gravest = runtime::kExitDone;
  for (const PlannedProcess& each : planned) {
    const auto checked = run_check(each, bin);
    if (!checked) return;
    for (const std::string& line : checked->lines)
      if (said.insert(line).second) out << each.process.name << ": " << line << '\n';
    if (checked->code == runtime::kExitDone) continue;
    if (checked->code == runtime::kExitMissing && where == Checked::kElsewhere) {
      out << each.process.name << ": missing where this check runs; its own host may have it\n";
      continue;
    }
    refused +=
        (refused.empty() ? "" : "\n") + each.process.name + ": " + reason(*checked, each.process.component);
    // What is wrong in the files comes before what is missing here.
    const bool graver = gravest == runtime::kExitDone || checked->code == runtime::kExitUsage;
    if (graver) gravest = checked->code;
  }
  if (gravest != runtime::kExitDone) fail(gravest, refused);
}

std::filesystem::path component_folder() {
  return std::filesystem::read_symlink("/proc/self/exe").parent_path();
}

}  // namespace phantom::phantom_session

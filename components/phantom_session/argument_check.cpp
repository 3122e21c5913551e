#include "components/phantom_session/argument_check.hpp"

#include <sys/mman.h>
#include <unistd.h>

#include <fstream>
#include <stdexcept>

#include "common/core/errors.hpp"
#include "common/runtime/process/process.hpp"
#include "components/phantom_session/supervisor.hpp"

namespace phantom::phantom_session {
namespace {

constexpr double kPoll_s = 0.02;

/// Returns the line that says what is wrong: the last one that does not mention --help, without the
/// component's name.
std::string reason(const std::filesystem::path& output, const std::string& component) {
  std::ifstream lines(output);
  std::string last;
  for (std::string line; std::getline(lines, line);) {
    if (!line.empty() && line.find("--help") == std::string::npos) last = line;
  }
  return last.starts_with(component + ": ") ? last.substr(component.size() + 2) : last;
}

}  // namespace

void check_arguments(const std::vector<PlannedProcess>& planned, const std::filesystem::path& bin) {
  for (const PlannedProcess& each : planned) {
    if (!each.own_arguments) continue;
    const int memory = memfd_create("output", MFD_CLOEXEC);
    const std::filesystem::path output = "/proc/self/fd/" + std::to_string(memory);
    ProcessSpec spec{each.process.name, bin / each.process.component, {"--check"}, 0, output};
    spec.arguments.insert(spec.arguments.end(), each.arguments.begin(), each.arguments.end());
    Supervisor supervisor;
    supervisor.start(spec);
    std::vector<ProcessOutcome> ended;
    while (ended.empty() && runtime::sleep_unless_stopped(kPoll_s)) ended = supervisor.newly_dead();
    if (ended.empty()) return;
    const int code = *ended.front().exit_code;
    const std::string said = each.process.name + ": " + reason(output, each.process.component);
    close(memory);
    if (code == runtime::kExitUsage) throw core::ConfigError(said);
    if (code == runtime::kExitMissing) throw core::MissingError(said);
    if (code != runtime::kExitDone)
      throw std::runtime_error(said + " (its --check ended with code " + std::to_string(code) + ")");
  }
}

std::filesystem::path component_folder() {
  return std::filesystem::read_symlink("/proc/self/exe").parent_path();
}

}  // namespace phantom::phantom_session

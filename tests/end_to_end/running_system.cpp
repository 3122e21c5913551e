#include "tests/end_to_end/running_system.hpp"

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <fstream>
#include <sstream>

#include "tests/support/own_domain.hpp"

namespace phantom::end_to_end {
namespace {

using test::all_replaced;
using test::replaced;

// The files for drives on CAN, on buses of the test's own, where frames take no time: they come in one go,
// and a slow machine is not woken for each of some ten thousand a second.
void write_can_files(const std::filesystem::path& folder) {
  for (const auto& entry : std::filesystem::directory_iterator(PHANTOM_SOURCE_DIR "/deploy/can")) {
    if (entry.path().extension() != ".yaml") continue;
    std::string text =
        all_replaced(read_text(entry.path()), "user:", "user:" + std::to_string(getpid()) + "_");
    text = all_replaced(text, ": ../", ": " PHANTOM_SOURCE_DIR "/deploy/");
    std::ofstream(folder / entry.path().filename())
        << all_replaced(text, "\nbit_rate: 1000000", "\nbit_rate: 0");
  }
}

// The shipped topology, with absolute paths and changed parameters.
void write_topology(const std::filesystem::path& folder, const std::string& name,
                    const RunningSystem::Changes& changes) {
  const std::filesystem::path source = PHANTOM_SOURCE_DIR;
  std::string topology = read_text(source / "deploy/topologies" / (name + ".yaml"));
  topology = replaced(topology, "../qos/", (source / "deploy/qos/").string());
  topology = all_replaced(topology, "../cells/", (source / "deploy/cells/").string());
  topology = all_replaced(topology, "../cartesian/", (source / "deploy/cartesian/").string());
  topology = all_replaced(topology, "../can/", folder.string() + "/");
  for (const auto& [component, pieces] : changes) {
    const std::string file = component + ".yaml";
    std::string text = read_text(source / "components" / component / file);
    for (const auto& [from, to] : pieces) text = replaced(text, from, to);
    std::ofstream(folder / file) << text;
    topology = replaced(
        topology, "component: " + component,
        "component: " + component + ", arguments: [\"--config\", \"" + (folder / file).string() + "\"]");
  }
  std::ofstream(folder / "topology.yaml") << topology;
}

}  // namespace

RunningSystem::RunningSystem(double seconds, const std::string& topology_name, const std::string& without,
                             Changes changes)
    : domain_(test::own_domain()) {
  static int count = 0;
  folder_ = std::filesystem::temp_directory_path() /
            ("phantom_system_" + std::to_string(getpid()) + "_" + std::to_string(count++));
  std::filesystem::create_directories(report());
  write_can_files(folder_);
  changes["synthetic_viewer"].emplace_back("port: 8080", "port: 0");  // a free one
  write_topology(folder_, topology_name, changes);
  const std::string executable = PHANTOM_BIN_DIR "/phantom_session",
                    topology = (folder_ / "topology.yaml").string(), domain = std::to_string(domain_),
                    length = std::to_string(seconds), report_dir = report().string(),
                    log = (folder_ / "session.log").string();
  pid_ = fork();
  if (pid_ == 0) {
    const int file = open(log.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
    dup2(file, STDOUT_FILENO);
    dup2(file, STDERR_FILENO);
    const char* const end = nullptr;
    setenv("PHANTOM_STATE_DIR", (folder_ / "state").c_str(), 1);  // a stop of one run is not one of the next
    execl(executable.c_str(), executable.c_str(), "--deployment", topology.c_str(), "--domain",
          domain.c_str(), "--seconds", length.c_str(), "--report-dir", report_dir.c_str(),
          without.empty() ? end : "--without", without.c_str(), end);
    _exit(127);
  }
}

RunningSystem::~RunningSystem() {
  if (running()) {
    stop();
    wait();
  }
  std::filesystem::remove_all(folder_);
}

core::NetworkOptions RunningSystem::network() const {
  core::NetworkOptions network;
  network.domain = domain_;
  network.qos_profiles = PHANTOM_SOURCE_DIR "/deploy/qos/phantom.xml";
  network.interfaces = {"127.0.0.1"};
  return network;
}

std::string RunningSystem::output() const { return read_text(folder_ / "session.log"); }

pid_t RunningSystem::process(const std::string& word) const {
  const std::string of_session =
      "/proc/" + std::to_string(pid_) + "/task/" + std::to_string(pid_) + "/children";
  std::istringstream children(read_text(of_session));
  for (pid_t child = 0; children >> child;) {
    if (read_text("/proc/" + std::to_string(child) + "/cmdline").find(word) != std::string::npos)
      return child;
  }
  return 0;
}

void RunningSystem::stop(int signal) { kill(pid_, signal); }

bool RunningSystem::running() {
  if (exit_code_ >= 0) return false;
  int status = 0;
  if (waitpid(pid_, &status, WNOHANG) == pid_)
    exit_code_ = WIFSIGNALED(status) ? 128 + WTERMSIG(status) : WEXITSTATUS(status);
  return exit_code_ < 0;
}

int RunningSystem::wait() {
  while (running()) usleep(10'000);
  return exit_code_;
}

}  // namespace phantom::end_to_end

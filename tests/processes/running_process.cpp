#include "tests/processes/running_process.hpp"

#include <fcntl.h>
#include <linux/capability.h>
#include <sched.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <sstream>
#include <stdexcept>

#include "common/core/clock.hpp"
#include "common/core/thread_config.hpp"
#include "fast_dds/threads.hpp"
#include "tests/support/files.hpp"

namespace phantom::processes {
namespace {

/// Returns a thread's name in the table of threads. Fast DDS 3 names its threads itself.
std::string table_name(const std::string& name) {
  const std::string dds = core::place_of(core::ThreadRole::kDds).name;
  return fast_dds::is_own_thread(name, dds) ? dds : name;
}

namespace fs = std::filesystem;
using test::read_text;
using test::replaced;

std::vector<pid_t> numbers_in(const fs::path& folder) {
  std::vector<pid_t> numbers;
  std::error_code gone;
  for (fs::directory_iterator entry(folder, gone), end; !gone && entry != end; entry.increment(gone))
    numbers.push_back(static_cast<pid_t>(std::atol(entry->path().filename().c_str())));
  return numbers;
}

constexpr core::Nanoseconds kLook_ns = 20 * core::kNsPerMillisecond;  // that a look at /proc may take

/// Adds up for how long threads wait for a processor. The kernel counts a wait when it is over (schedstat),
/// so one that goes on is counted here: the thread is runnable and has not run since.
class CpuWaits {
 public:
  /// A process and all that it has started, as they are now.
  void note(pid_t pid) {
    const fs::path tasks = "/proc/" + std::to_string(pid) + "/task";
    for (const pid_t thread : numbers_in(tasks)) {
      note_thread(thread, tasks / std::to_string(thread));
      std::istringstream children(read_text(tasks / std::to_string(thread) / "children"));
      for (pid_t child = 0; children >> child;) note(child);
    }
  }
  double sum_s() const {
    double sum = 0.0;
    for (const auto& [number, thread] : threads_) sum += core::seconds(thread.waited_ns + thread.waiting_ns);
    return sum;
  }

 private:
  struct Thread {
    core::Nanoseconds ran_ns = 0, counted_ns = 0;  // as the kernel told last
    core::Nanoseconds waited_ns = 0, waiting_ns = 0, runnable_since_ns = 0;
  };
  void note_thread(pid_t number, const fs::path& folder) {
    std::istringstream schedstat(read_text(folder / "schedstat"));
    core::Nanoseconds ran_ns = 0, counted_ns = 0;
    if (!(schedstat >> ran_ns >> counted_ns)) return;  // it has just ended
    const std::string stat = read_text(folder / "stat");
    const auto name_end = stat.rfind(')');
    const bool runnable = name_end + 2 < stat.size() && stat[name_end + 2] == 'R';
    const auto [found, fresh] = threads_.try_emplace(number);
    Thread& thread = found->second;
    const core::Nanoseconds now_ns = core::monotonic_ns();
    const bool stood_still = !fresh && ran_ns == thread.ran_ns && counted_ns == thread.counted_ns;
    if (!fresh) thread.waited_ns += counted_ns - thread.counted_ns;
    thread.ran_ns = ran_ns;
    thread.counted_ns = counted_ns;
    if (!stood_still || !runnable || thread.runnable_since_ns == 0) thread.runnable_since_ns = now_ns;
    thread.waiting_ns = runnable ? now_ns - thread.runnable_since_ns : 0;
  }
  std::map<pid_t, Thread> threads_;
};

}  // namespace

RunningProcess::RunningProcess(const std::string& name, const Options& options, const fs::path& folder)
    : log_(folder / (name + ".log")) {
  std::vector<std::string> words{PHANTOM_BIN_DIR "/" + name};
  words.insert(words.end(), options.arguments.begin(), options.arguments.end());
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  const int file = open(log_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  const int output = options.output >= 0 ? options.output : file;
  int input[2];
  if (pipe2(input, O_CLOEXEC) != 0) throw std::runtime_error("no pipe");
  pid_ = fork();
  if (pid_ == 0) {
    setenv("STATE_DIRECTORY", folder.c_str(), 1);
    for (const auto& [key, value] : options.environment) setenv(key.c_str(), value.c_str(), 1);
    dup2(input[0], STDIN_FILENO);  // of which nothing comes
    fcntl(input[1], F_SETFD, 0);   // and which does not end
    dup2(output, STDOUT_FILENO);
    dup2(output, STDERR_FILENO);
    if (!options.real_time) {
      const rlimit none{0, 0};
      setrlimit(RLIMIT_RTPRIO, &none);
      prctl(PR_CAPBSET_DROP, CAP_SYS_NICE);  // what root gets by exec
    }
    execv(argv[0], argv.data());
    _exit(127);
  }
  close(file);
  close(input[0]);
  close(input[1]);
}

RunningProcess::~RunningProcess() {
  if (running()) end(SIGKILL);
}

bool RunningProcess::running() {
  if (exit_code_ >= 0) return false;
  int status = 0;
  if (waitpid(pid_, &status, WNOHANG) == pid_)
    exit_code_ = WIFSIGNALED(status) ? 128 + WTERMSIG(status) : WEXITSTATUS(status);
  return exit_code_ < 0;
}

Duration RunningProcess::end(int signal, double limit_s) {
  CpuWaits waits;
  waits.note(pid_);
  const core::Nanoseconds start_ns = core::monotonic_ns();
  core::Nanoseconds looked_ns = start_ns, blind_ns = 0;
  kill(pid_, signal);
  for (bool ended = false; !ended;) {
    ended = !running();
    if (!ended) {
      waits.note(pid_);
      usleep(2'000);
    }
    // While the observer is held up it cannot see the end: that time is nobody's.
    const core::Nanoseconds now_ns = core::monotonic_ns();
    blind_ns += std::max<core::Nanoseconds>(0, now_ns - looked_ns - kLook_ns);
    looked_ns = now_ns;
    if (core::seconds(now_ns - start_ns) > limit_s) kill(pid_, SIGKILL);
  }
  Duration took;
  took.wall_s = core::seconds(core::monotonic_ns() - start_ns);
  took.waited_for_cpu_s = std::min(took.wall_s, waits.sum_s() + core::seconds(blind_ns));
  return took;
}

std::string RunningProcess::log() const { return read_text(log_); }

std::vector<ThreadSeen> RunningProcess::threads() const {
  std::vector<ThreadSeen> seen;
  const fs::path tasks = "/proc/" + std::to_string(pid_) + "/task";
  for (const pid_t thread : numbers_in(tasks)) {
    const std::string stat = read_text(tasks / std::to_string(thread) / "stat");
    const auto open = stat.find('('), close = stat.rfind(')');
    if (close == std::string::npos) continue;  // it has just ended
    std::istringstream fields(stat.substr(close + 2));
    std::vector<std::string> all;
    for (std::string field; fields >> field;) all.push_back(field);
    if (all.size() < 39) continue;
    // Fields 40 and 41 of proc(5), counted from 1; the third is all[0].
    seen.push_back({table_name(stat.substr(open + 1, close - open - 1)), std::stoi(all[38]) == SCHED_FIFO,
                    std::stoi(all[37])});
  }
  return seen;
}

pid_t RunningProcess::thread(const std::string& name) const {
  const fs::path tasks = "/proc/" + std::to_string(pid_) + "/task";
  for (const pid_t thread : numbers_in(tasks)) {
    std::string comm = read_text(tasks / std::to_string(thread) / "comm");
    if (!comm.empty()) comm.pop_back();  // the line's end
    if (table_name(comm) == name) return thread;
  }
  return 0;
}

fs::path write_topology(const fs::path& folder) {
  const fs::path source = PHANTOM_SOURCE_DIR;
  const fs::path viewer = write_config(folder, "synthetic_viewer", "port: 8080", "port: 0");
  std::string text = read_text(source / "deploy/topologies/single_host.yaml");
  text = replaced(text, "../qos/", (source / "deploy/qos/").string());
  text = replaced(text, "../cells/", (source / "deploy/cells/").string());
  text = replaced(text, "component: synthetic_viewer",
                  "component: synthetic_viewer, arguments: [\"--config\", \"" + viewer.string() + "\"]");
  std::ofstream(folder / "topology.yaml") << text;
  return folder / "topology.yaml";
}

fs::path write_config(const fs::path& folder, const std::string& component, const std::string& from,
                      const std::string& to) {
  const std::string text =
      read_text(fs::path(PHANTOM_SOURCE_DIR) / "components" / component / (component + ".yaml"));
  std::ofstream(folder / (component + ".yaml")) << replaced(text, from, to);
  return folder / (component + ".yaml");
}

FullPipe::FullPipe() {
  if (pipe2(ends_, O_CLOEXEC | O_NONBLOCK) != 0) throw std::runtime_error("no pipe");
  const std::string piece(4096, 'x');
  while (write(ends_[1], piece.data(), piece.size()) > 0) {
  }
  while (write(ends_[1], "x", 1) > 0) {
  }
  fcntl(ends_[1], F_SETFL, 0);  // a write waits, as on a pipe that a process inherits
}

FullPipe::~FullPipe() {
  close(ends_[0]);
  close(ends_[1]);
}

NotifySocket::NotifySocket() : name_("@phantom_notify_" + std::to_string(getpid())) {
  socket_ = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::memcpy(address.sun_path + 1, name_.data() + 1, name_.size() - 1);
  const auto length = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + name_.size());
  if (bind(socket_, reinterpret_cast<const sockaddr*>(&address), length) != 0)
    throw std::runtime_error(name_ + ": " + std::strerror(errno));
}

NotifySocket::~NotifySocket() { close(socket_); }

std::vector<std::string> NotifySocket::take() const {
  std::vector<std::string> all;
  char text[2048];
  for (ssize_t got = 0; (got = recv(socket_, text, sizeof text, MSG_DONTWAIT)) >= 0;)
    all.emplace_back(text, static_cast<std::size_t>(got));
  return all;
}

}  // namespace phantom::processes

#include "common/runtime/process/process.hpp"

#include <poll.h>
#include <spdlog/fmt/fmt.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <system_error>

#include "common/core/clock.hpp"
#include "common/core/errors.hpp"
#include "common/core/version.hpp"
#include "common/runtime/cell/cell.hpp"
#include "common/runtime/configuration/deployment.hpp"
#include "common/runtime/process/last_words.hpp"
#include "common/runtime/process/log.hpp"

namespace phantom::runtime {
namespace {

std::atomic<bool> g_stop{false};
int g_stop_event = -1;  // readable once a stop is requested; created before the handlers are installed

std::atomic<std::uint32_t> g_emergency_stops{0};

std::atomic<int> g_end_at_once{0};  // number of living EndsAtOnce objects
std::atomic<int> g_code_at_once{kExitDone};

void on_signal(int) {
  if (g_end_at_once.load(std::memory_order_relaxed) > 0)
    _exit(g_code_at_once.load(std::memory_order_relaxed));
  request_stop();
}
void on_emergency(int) { g_emergency_stops.fetch_add(1, std::memory_order_relaxed); }

void install_signal_handlers() {
  g_stop_event = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  struct sigaction action {};
  action.sa_handler = on_signal;
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  action.sa_handler = on_emergency;
  sigaction(SIGUSR1, &action, nullptr);
  std::signal(SIGPIPE, SIG_IGN);
}

void add_common_options(Command app, ProcessOptions& options, const std::vector<const char*>& parameters) {
  app.option("--config", options.config, "parameters of this component (YAML); default: the shipped ones");
  app.text_flag("--help-config", fmt::format("{}", fmt::join(parameters, "\n\n")),
                "print every parameter with its default, range and meaning: the shipped file");
  app.option("--deployment", options.deployment, "topology: domain, hosts, transports, cell (YAML)");
  app.text_flag("--help-deployment", kTopologyKeys, "print every key of a topology with range and meaning");
  app.text_flag("--help-cell", fmt::format("{}\n\n{}", kCellKeys, kArmKeys),
                "print every key of cell and arm files with range and meaning");
  app.option(
      "--name", options.name,
      "which of the topology's processes this is, if there are several of this component; default: the "
      "component's name");
  app.option("--domain", options.domain, "DDS domain, instead of the topology's").between(0, 232);
  app.option("--host", options.host,
             "which of the topology's hosts this is; default: its only one, or the one whose interfaces "
             "this machine has");
  app.option("--log-level", options.log_level, "trace, debug, info, warning, error or off")
      .one_of({"trace", "debug", "info", "warning", "error", "off"});
  app.flag("--check", options.check, "validate configuration, files and devices, then exit");
  app.option("--state-dir", options.state_dir,
             "folder for what outlives the process (the stop in force); "
             "default: $STATE_DIRECTORY, or ~/.local/state/phantom");
  app.option("--report-dir", options.report_dir, "folder for the files that this session leaves behind");
}

int fail(const ProcessOptions& options, int code, const std::string& what) {
  print_line(options.component + ": " + what);
  return code;
}

}  // namespace

bool stop_requested() noexcept { return g_stop.load(std::memory_order_relaxed); }

EndsAtOnce::EndsAtOnce(ExitCode exit_code) noexcept {
  g_code_at_once.store(exit_code);
  g_end_at_once.fetch_add(1);
  if (stop_requested()) _exit(exit_code);  // the signal arrived just before
}
EndsAtOnce::~EndsAtOnce() { g_end_at_once.fetch_sub(1); }

std::uint32_t emergency_stop_signals() noexcept { return g_emergency_stops.load(std::memory_order_relaxed); }

void request_stop() noexcept {
  g_stop.store(true, std::memory_order_relaxed);
  const std::uint64_t one = 1;
  if (g_stop_event >= 0) [[maybe_unused]]
    const auto written = write(g_stop_event, &one, sizeof one);
}

int configuration_is_valid(const std::string& found) {
  std::cout << "configuration is valid" << found << '\n';
  return kExitDone;
}

bool sleep_unless_stopped(double duration_s) {
  const core::Nanoseconds until = core::monotonic_ns() + core::from_seconds(duration_s);
  while (!stop_requested()) {
    const core::Nanoseconds left = until - core::monotonic_ns();
    if (left <= 0) return true;
    pollfd wait{g_stop_event, POLLIN, 0};
    const timespec timeout{left / core::kNsPerSecond, left % core::kNsPerSecond};
    ppoll(&wait, 1, &timeout, nullptr);
  }
  return false;
}

std::filesystem::path share_path(const std::filesystem::path& relative) {
  if (const char* given = std::getenv("PHANTOM_SHARE")) return std::filesystem::path(given) / relative;
  const auto self = std::filesystem::read_symlink("/proc/self/exe");
  return self.parent_path().parent_path() / "share" / "phantom" / relative;
}

std::filesystem::path state_path(const ProcessOptions& options) {
  if (!options.state_dir.empty()) return options.state_dir;
  const auto variable = [](const char* name) -> std::filesystem::path {
    const char* value = std::getenv(name);
    return value != nullptr ? value : "";
  };
  if (const auto given = variable("STATE_DIRECTORY"); !given.empty()) return given;
  if (const auto given = variable("XDG_STATE_HOME"); !given.empty()) return given / "phantom";
  if (const auto home = variable("HOME"); !home.empty()) return home / ".local" / "state" / "phantom";
  throw MissingError(
      "no folder for what must outlive the process: $HOME is not set; give one with --state-dir");
}

namespace {

int ended_with(const ProcessOptions& options, const std::function<int()>& run) {
  try {
    return run();
  } catch (const ConfigError& problem) {
    return fail(options, kExitUsage, problem.what());
  } catch (const MissingError& problem) {
    return fail(options, kExitMissing, problem.what());
  } catch (const std::exception& problem) {
    return fail(options, kExitFailed, problem.what());
  }
}

// Applies what the topology says of this process: parameters unless --config names others, and arguments
// ahead of those of the command line, unless that asks for something by a subcommand. What is wrong with the
// topology is told by whoever needs it: a component by its own load_deployment().
void apply_entry(CommandLine& line, ProcessOptions& options, int argc, const char* const* argv) {
  std::optional<DeployedProcess> own;
  try {
    own = load_deployment(options).own;
  } catch (const std::exception&) {
    return;
  }
  if (!own || own->component != options.component) {
    if (options.name.empty()) return;
    throw ConfigError("--name " + options.name + ": " + options.deployment.string() + " has no " +
                      options.component + " of that name here; allowed: a name that it has, or none");
  }
  if (options.config.empty()) options.config = own->config;
  if (own->arguments.empty() || line.has_subcommand()) return;
  try {
    line.parse_after(own->arguments, argc, argv);
  } catch (const ConfigError& problem) {
    throw ConfigError(own->place + ".arguments: " + problem.what());
  }
}

}  // namespace

int process_main(int argc, char** argv, const ProcessDescription& description) {
  leave_last_words(description.name);
  ProcessOptions options;
  options.component = description.name;
  CommandLine line(description.name, description.summary, std::string("phantom ") + core::version());
  add_common_options(line.root(), options, description.parameters);
  if (description.add_options) description.add_options(line.root());
  line.root().details(
      description.details +
      "\nExit codes: 0 done, 1 failed while running, 2 wrong arguments or configuration, 3 a needed "
      "device, file "
      "or peer is missing.");
  if (const auto wrong = line.parse(argc, argv)) return *wrong ? kExitUsage : kExitDone;
  const bool names_topology = !options.deployment.empty();
  if (!names_topology) options.deployment = share_path("deploy/topologies/single_host.yaml");
  const int code = ended_with(options, [&] {
    std::error_code unreadable;  // as where a folder on the way may not be entered
    if (names_topology && !std::filesystem::exists(options.deployment, unreadable))
      throw core::MissingError("--deployment " + options.deployment.string() + ": there is no such file");
    apply_entry(line, options, argc, argv);
    if (options.config.empty()) options.config = share_path("config/" + description.name + ".yaml");
    begin_log(options.component, options.log_level);
    install_signal_handlers();
    return description.run(options);
  });
  finish_log();
  return code;
}

}  // namespace phantom::runtime

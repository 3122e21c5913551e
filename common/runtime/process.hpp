#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "common/core/errors.hpp"
#include "common/core/operator_request.hpp"
#include "common/runtime/command_line.hpp"

namespace phantom::runtime {

/// Exit codes of every executable (documented in --help).
enum ExitCode { kExitDone = 0, kExitFailed = 1, kExitUsage = 2, kExitMissing = 3 };

/// What it means for the exit code how a person's request went.
inline ExitCode exit_code(core::OperatorOutcome outcome) noexcept {
  return outcome == core::OperatorOutcome::kDone      ? kExitDone
         : outcome == core::OperatorOutcome::kNotDone ? kExitFailed
                                                      : kExitMissing;
}

using core::MissingError;

/// The options that every executable has.
struct ProcessOptions {
  std::string component;             ///< executable's name
  std::filesystem::path config;      ///< default: <prefix>/share/phantom/config/<component>.yaml
  std::filesystem::path deployment;  ///< topology file; default: deploy/topologies/single_host.yaml
  int domain = -1;                   ///< −1: the topology's
  std::string host;                  ///< which of the topology's hosts this is; empty: found by its addresses
  std::string log_level = "info";
  bool check = false;                ///< validate everything that can be validated, then exit
  std::filesystem::path state_dir;   ///< for what must outlive the process; empty: state_path()
  std::filesystem::path report_dir;  ///< where to leave the session's own files; empty: nowhere
};

/// What an executable is made of. `add_options` may add its own (also subcommands); `run` gets the parsed
/// options, validates its configuration first, returns at once if `options.check`, and otherwise works until
/// stop_requested().
struct ProcessDescription {
  std::string name;
  std::string summary;  ///< one paragraph for --help
  std::string details;  ///< what a new user should know: topics, examples; printed after the options
  std::function<void(Command)> add_options;
  std::function<int(const ProcessOptions&)> run;
  std::vector<const char*> parameters;  ///< the table of those in --config (YAML), for --help-config
};

/// Parses the command line, sets up logging and signals, runs, and maps exceptions to exit codes:
/// ConfigError and wrong arguments → 2, MissingError → 3, any other exception → 1, each with one line on
/// stderr. Ends in time whether or not anybody reads stderr.
int process_main(int argc, char** argv, const ProcessDescription& description);

/// True after SIGINT, SIGTERM or request_stop(). Real-time safe: yes.
bool stop_requested() noexcept;
/// Asks the process to end in order, as a signal would. Async-signal-safe.
void request_stop() noexcept;
/// How often SIGUSR1 came: each one asks a process that moves something for an emergency stop, and a recorder
/// to write what it holds in memory. Real-time safe: yes.
std::uint32_t emergency_stop_signals() noexcept;
/// While one lives, SIGINT and SIGTERM end the process at once, wherever it is: for the part of a start that
/// reads files and computes, and has begun nothing yet that needs an end in order (a participant, a bus, a
/// file that is written), and for commands that have nothing of the kind. Ends the process itself if such a
/// signal came before.
class EndsAtOnce {
 public:
  /// `exit_code`: 0 for a service, whose work such a signal ends; a command that did not come to its end has
  /// failed.
  explicit EndsAtOnce(ExitCode exit_code = kExitDone) noexcept;
  ~EndsAtOnce();
  EndsAtOnce(const EndsAtOnce&) = delete;
  EndsAtOnce& operator=(const EndsAtOnce&) = delete;
};

/// Sleeps until `duration_s` has passed or a stop is requested; returns whether to go on.
bool sleep_unless_stopped(double duration_s);

/// <prefix>/share/phantom/<relative>, with <prefix> found from the running executable; the source tree's link
/// in a build tree. The environment variable PHANTOM_SHARE overrides it.
std::filesystem::path share_path(const std::filesystem::path& relative);

/// The folder for what must outlive the process: options.state_dir; by default $STATE_DIRECTORY, which the
/// service manager sets, or $XDG_STATE_HOME/phantom, or ~/.local/state/phantom. Throws MissingError if none
/// is known. It need not exist yet.
std::filesystem::path state_path(const ProcessOptions& options);

}  // namespace phantom::runtime

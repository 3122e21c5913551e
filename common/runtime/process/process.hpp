#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "common/core/errors.hpp"
#include "common/runtime/process/command_line.hpp"
#include "common/runtime/process/signals.hpp"
#include "common/teleop/commands/operator_command.hpp"

namespace phantom::runtime {

/// Exit codes of every executable (documented in --help).
enum ExitCode { kExitDone = 0, kExitFailed = 1, kExitUsage = 2, kExitMissing = 3 };

/// Returns the exit code for the outcome of a person's request.
inline ExitCode exit_code(teleop::OperatorOutcome outcome) noexcept {
  return outcome == teleop::OperatorOutcome::kDone      ? kExitDone
         : outcome == teleop::OperatorOutcome::kNotDone ? kExitFailed
                                                        : kExitMissing;
}

using core::ConfigError;
using core::MissingError;

/// The options that every executable has.
struct ProcessOptions {
  std::string component;             ///< name of the executable
  std::string name;                  ///< of its entry in the topology; empty: the component's
  std::filesystem::path config;      ///< default: <prefix>/share/phantom/config/<component>.yaml
  std::filesystem::path deployment;  ///< topology file; default: deploy/topologies/single_host.yaml
  bool deployment_named = false;     ///< on the command line
  int domain = -1;                   ///< −1: the topology's
  std::string host;                  ///< name of this host in the topology; empty: found by its addresses
  std::string log_level = "info";
  bool check = false;               ///< validate everything that can be validated, then exit
  std::filesystem::path state_dir;  ///< folder for what must outlive the process; empty: stop_place() decides
  std::filesystem::path report_dir;  ///< folder for the session's own files; empty: none are written
};

/// Describes an executable. `add_options` may add options and subcommands. `run` receives the parsed options,
/// validates its configuration first, returns at once if `options.check` is set, and otherwise works until
/// stop_requested().
struct ProcessDescription {
  std::string name;
  std::string summary;  ///< one paragraph for --help
  std::string details;  ///< topics and examples for a new user; printed after the options
  std::function<void(Command)> add_options;
  std::function<int(const ProcessOptions&)> run;
  std::vector<const char*> parameters;  ///< tables of the parameters in --config (YAML), for --help-config
};

/// Sets up signals, parses the command line, sets up logging, runs, and maps exceptions to exit codes:
/// ConfigError and wrong arguments → 2, MissingError → 3, any other exception → 1, each with one line on
/// stderr. Ends promptly even if nobody reads stderr. If it dies, it tells why (leave_last_words()).
int process_main(int argc, char** argv, const ProcessDescription& description);

/// Lets a signal that ends the process (signals.hpp) end it at once while an object of this class lives. For
/// the part of a start that reads files and computes and has not begun anything that needs an orderly end (a
/// participant, a bus, an open file), and for commands without anything of the kind. The constructor ends the
/// process if such a signal arrived before.
class EndsAtOnce {
 public:
  /// `exit_code`: 0 for a service, which such a signal ends normally; a command that was interrupted has
  /// failed.
  explicit EndsAtOnce(ExitCode exit_code = kExitDone) noexcept;
  ~EndsAtOnce();
  EndsAtOnce(const EndsAtOnce&) = delete;
  EndsAtOnce& operator=(const EndsAtOnce&) = delete;
};

/// Says on standard output that --check found nothing wrong; `found` goes on after "configuration is valid".
/// Returns the exit code.
int configuration_is_valid(const std::string& found = "");

/// Sleeps until `duration_s` has passed or a stop is requested. Returns false if a stop was requested.
bool sleep_unless_stopped(double duration_s);

/// Returns <prefix>/share/phantom/<relative>. <prefix> is found from the running executable; in a build tree
/// the folder is a link to the source tree. The environment variable PHANTOM_SHARE replaces
/// <prefix>/share/phantom.
std::filesystem::path share_path(const std::filesystem::path& relative);

}  // namespace phantom::runtime

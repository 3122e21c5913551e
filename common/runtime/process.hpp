#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>

#include "common/core/errors.hpp"

namespace CLI {
class App;
}

namespace phantom::runtime {

/// Exit codes of every executable (documented in --help).
enum ExitCode { kExitDone = 0, kExitFailed = 1, kExitUsage = 2, kExitMissing = 3 };

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
  std::filesystem::path report_dir;  ///< where to leave the session's own files; empty: nowhere
};

/// What an executable is made of. `add_options` may add its own (also subcommands); `run` gets the parsed
/// options, validates its configuration first, returns at once if `options.check`, and otherwise works until
/// stop_requested().
struct ProcessDescription {
  std::string name;
  std::string summary;  ///< one paragraph for --help
  std::string details;  ///< what a new user should know: topics, examples; printed after the options
  std::function<void(CLI::App&)> add_options;
  std::function<int(const ProcessOptions&)> run;
};

/// Parses the command line, sets up logging and signals, runs, and maps exceptions to exit codes:
/// ConfigError and wrong arguments → 2, MissingError → 3, any other exception → 1, each with one line on
/// stderr.
int process_main(int argc, char** argv, const ProcessDescription& description);

/// True after SIGINT, SIGTERM or request_stop(). Real-time safe: yes.
bool stop_requested() noexcept;
/// Asks the process to end in order, as a signal would. Async-signal-safe.
void request_stop() noexcept;
/// How often SIGUSR1 came: each one asks a process that moves something for an emergency stop, and a recorder
/// to write what it holds in memory. Real-time safe: yes.
std::uint32_t emergency_stop_signals() noexcept;
/// Sleeps until `duration_s` has passed or a stop is requested; returns whether to go on.
bool sleep_unless_stopped(double duration_s);

/// <prefix>/share/phantom/<relative>, with <prefix> found from the running executable; the source tree's link
/// in a build tree. The environment variable PHANTOM_SHARE overrides it.
std::filesystem::path share_path(const std::filesystem::path& relative);

}  // namespace phantom::runtime

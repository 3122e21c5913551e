#pragma once

#include <string>
#include <vector>

#include "common/runtime/configuration/deployment.hpp"
#include "common/runtime/process/process.hpp"
#include "components/phantom_session/config.hpp"

namespace phantom::phantom_session {

/// What the user requested for one session.
struct SessionRequest {
  double seconds = 0.0;                     ///< from when all components are ready; 0: until Ctrl-C
  std::vector<std::string> without;         ///< components that the user runs otherwise
  std::vector<std::string> master_options;  ///< passed on to master_io (operator model, law)
  std::filesystem::path page_secrets;       ///< passed on to synthetic_viewer; empty: none
};

/// A process to start, with its arguments.
struct PlannedProcess {
  runtime::DeployedProcess process;
  std::vector<std::string> arguments;
  bool own_arguments = false;  ///< it gets more than the common arguments
};
/// Plans the processes to start: those that the topology lists for the host, each with the common options.
/// Throws ConfigError if the host is unknown.
std::vector<PlannedProcess> plan(const runtime::Deployment& deployment,
                                 const runtime::ProcessOptions& options, const SessionRequest& request);

/// Runs a session to its end and writes its report. Returns the process's exit code: 0 done, 1 a component
/// died or never became ready.
int run_session(const runtime::ProcessOptions& options, const runtime::Deployment& deployment,
                const Config& config, const SessionRequest& request);

}  // namespace phantom::phantom_session

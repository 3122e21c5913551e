#pragma once

#include <string>
#include <vector>

#include "common/runtime/deployment.hpp"
#include "common/runtime/process.hpp"
#include "components/phantom_session/config.hpp"

namespace phantom::phantom_session {

/// What the user asked of one session.
struct SessionRequest {
  double seconds = 0.0;                     ///< after all components are ready; 0: until Ctrl-C
  std::vector<std::string> without;         ///< components that somebody else runs
  std::vector<std::string> master_options;  ///< passed on to master_io (operator model, law)
};

/// The processes to start for a request: the host's of the topology, each with the common options. Throws
/// ConfigError if the host is unknown.
struct PlannedProcess {
  runtime::DeployedProcess process;
  std::vector<std::string> arguments;
  bool own_arguments = false;  ///< whether it gets more than the common ones
};
std::vector<PlannedProcess> plan(const runtime::Deployment& deployment,
                                 const runtime::ProcessOptions& options, const SessionRequest& request);

/// Runs a session to its end and writes its report. Returns the process's exit code: 0 done, 1 a component
/// died or never became ready.
int run_session(const runtime::ProcessOptions& options, const runtime::Deployment& deployment,
                const Config& config, const SessionRequest& request);

}  // namespace phantom::phantom_session

#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/core/network.hpp"
#include "common/runtime/process.hpp"

namespace phantom::runtime {

/// One process of a topology, as the launcher starts it.
struct DeployedProcess {
  std::string component;               ///< executable's name
  std::string name;                    ///< in logs and reports, once per host; the component's if not given
  std::filesystem::path config;        ///< its parameters; empty: the shipped ones
  std::vector<std::string> arguments;  ///< after the common ones
  bool on_topics = true;               ///< false: it sends no component_status, so nobody waits for that
  int nice = 0;                        ///< scheduling niceness; servo loops are left at 0
};

struct DeployedHost {
  std::string name;
  std::vector<DeployedProcess> processes;
  std::vector<std::string> interfaces;  ///< its own, instead of the topology's; empty: the topology's
  std::string interfaces_place;         ///< where they are written: "site.yaml:12: hosts[0].interfaces"
};

/// deploy/topologies/<name>.yaml: what is shared by all processes of a deployment.
struct Deployment {
  std::string name;
  std::filesystem::path file;
  core::NetworkOptions network;  ///< as it is on this host
  std::filesystem::path cell;    ///< cell.yaml
  std::vector<DeployedHost> hosts;
  std::string host;  ///< which of them this process is on; empty: not known, nor needed
};

/// Reads and checks the topology file that the options name; --domain wins over the file's. Paths in it are
/// relative to it. Where hosts have interfaces of their own, the network is that of options.host, or of the
/// host whose interfaces this machine has; neither is needed for a check. Throws ConfigError; MissingError if
/// this machine is none of the hosts.
Deployment load_deployment(const ProcessOptions& options);

}  // namespace phantom::runtime

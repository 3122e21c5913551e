#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace phantom::runtime {

/// One process of a topology, as the launcher starts it.
struct DeployedProcess {
  std::string component;               ///< executable's name
  std::vector<std::string> arguments;  ///< after the common ones
  int nice = 0;                        ///< scheduling niceness; servo loops are left at 0
};

struct DeployedHost {
  std::string name;
  std::vector<DeployedProcess> processes;
};

/// deploy/topologies/<name>.yaml: what is shared by all processes of a deployment.
struct Deployment {
  std::string name;
  std::filesystem::path file;
  int domain = 0;
  std::filesystem::path qos_profiles;      ///< Fast DDS XML profiles, one pair a topic
  std::filesystem::path cell;              ///< cell.yaml
  std::vector<std::string> interfaces;     ///< IP addresses that DDS may use; empty: all
  std::vector<std::string> initial_peers;  ///< "address" of hosts to announce to; empty: multicast discovery
  bool shared_memory = false;              ///< shared-memory transport between processes of one host
  std::vector<DeployedHost> hosts;
};

/// Reads and checks a topology file. Paths in it are relative to it. Throws ConfigError.
Deployment load_deployment(const std::filesystem::path& path);

}  // namespace phantom::runtime

#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "common/core/network.hpp"
#include "common/runtime/process/process.hpp"

namespace phantom::runtime {

/// One process of a topology. The process reads its entry itself, so that it is the same whoever starts it.
struct DeployedProcess {
  std::string component;               ///< name of the executable
  std::string name;                    ///< in logs and reports, unique on its host; default: the component's
  std::filesystem::path config;        ///< parameter file; empty: the shipped one
  std::filesystem::path cell;          ///< for this process, instead of the deployment's; empty: that one
  std::string partition;               ///< likewise its DDS partition; empty: the network's
  std::vector<std::string> arguments;  ///< before those of its command line, which win
  std::string place;                   ///< in the file: "site.yaml:14: hosts[0].processes[2]"
  bool on_topics = true;               ///< false: it publishes no component_status, so nobody waits for it
  bool simulation = false;             ///< it may simulate what it would otherwise move
  int nice = 0;                        ///< scheduling niceness; servo loops are left at 0
};

struct DeployedHost {
  std::string name;
  std::vector<DeployedProcess> processes;
  std::vector<std::string> interfaces;  ///< of this host; empty: the topology's interfaces apply
  std::string interfaces_place;         ///< place in the file: "site.yaml:12: hosts[0].interfaces"
};

/// Checked contents of deploy/topologies/<name>.yaml: what all processes of a deployment share.
struct Deployment {
  std::string name;
  std::filesystem::path file;
  core::NetworkOptions network;       ///< the options that apply on this host
  std::filesystem::path cell;         ///< cell.yaml
  std::string cell_place, qos_place;  ///< where the files of both are named, for messages
  std::vector<DeployedHost> hosts;
  std::string host;                    ///< the host of this process; empty: not known and not needed
  std::optional<DeployedProcess> own;  ///< this process's entry; none: the topology has none of its name here
};

/// Table of the keys of a topology file (topology.yaml).
extern const char* const kTopologyKeys;

/// Reads and checks the topology file of the options. --domain overrides the file's domain. Paths in the file
/// are relative to it. If hosts have interfaces of their own, the network is that of options.host, or of the
/// host whose interfaces this machine has; a check needs neither. The own entry is the one of options.name on
/// that host; where the host is not known, the one that all hosts have alike. Throws ConfigError, also if
/// they differ; throws MissingError if this machine is none of the hosts. Cell and partition of the own entry
/// are the deployment's.
Deployment load_deployment(const ProcessOptions& options);

/// Throws MissingError if the QoS profiles or the cell file are not there: by file, line and key of the
/// topology.
void require_files(const Deployment& deployment);

/// Ends a process that would simulate what it moves although its entry in the topology does not say
/// `simulation: true`. `setting`: what makes it simulate, "slave_io.yaml: driver: sim". Throws ConfigError.
void require_simulation_meant(const Deployment& deployment, const ProcessOptions& options,
                              const std::string& setting);

}  // namespace phantom::runtime

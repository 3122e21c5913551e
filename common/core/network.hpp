#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace phantom::core {

/// How a process joins the DDS domain. Read from the topology file; used by common/dds.
struct NetworkOptions {
  int domain = 0;         ///< DDS domain, 0…232
  std::string partition;  ///< the cell's DDS partition, where several share a domain; empty: the default
  /// XML file with a writer and a reader profile per topic; empty: all topics are of others (foreign).
  std::filesystem::path qos_profiles;
  std::string user_data;                ///< USER_DATA of the participant; empty: none
  std::string model_label;              ///< USER_DATA of its writers: arm and cell it works with; empty: none
  std::vector<std::string> interfaces;  ///< IP addresses of this host to use; empty: all
  /// Where the file lists them, for messages: "site.yaml:7: network.interfaces".
  std::string interfaces_place;
  std::vector<std::string> initial_peers;  ///< addresses of hosts to announce to; empty: multicast discovery
  /// Number of ports tried at an initial peer; participants beyond it are not discovered there.
  int participants_per_host = 64;
  /// "address:port" of the Fast DDS discovery servers 0, 1 …; empty: none.
  std::vector<std::string> discovery_servers;
  std::filesystem::path security;  ///< folder that deploy/security/make writes; empty: without DDS Security
  /// SCHED_FIFO priority 1…99 of the servo in whose haptic path the process is; it decides the priorities of
  /// the DDS threads (thread_place.hpp). 0: the process is in no haptic path.
  int servo_priority = 0;
};

/// Returns `network` for a process in the haptic path of a servo with that priority.
inline NetworkOptions in_haptic_path(NetworkOptions network, int servo_priority) {
  network.servo_priority = servo_priority;
  return network;
}

}  // namespace phantom::core

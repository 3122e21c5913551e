#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace phantom::core {

/// Where and how a process takes part in the data space. Read from the topology file; used by common/dds.
struct NetworkOptions {
  int domain = 0;                       ///< DDS domain, 0…232
  std::string partition;                ///< the cell's, where several share a domain; empty: the default one
  std::filesystem::path qos_profiles;   ///< XML file with a writer's and a reader's profile per topic
  std::vector<std::string> interfaces;  ///< IP addresses of this host to use; empty: all
  std::string interfaces_place;  ///< where they are written, for messages: "site.yaml:7: network.interfaces"
  std::vector<std::string> initial_peers;  ///< addresses of hosts to announce to; empty: multicast discovery
  int participants_per_host = 64;  ///< ports tried at an initial peer; more participants are not found there
  std::vector<std::string>
      discovery_servers;           ///< "address:port" of Fast DDS discovery servers 0, 1 …; empty: none
  std::filesystem::path security;  ///< folder that deploy/security/make made; empty: without DDS Security
  /// SCHED_FIFO priority 1…99 of the servo in whose haptic path the process is, for the places of the threads
  /// of DDS (thread_place.hpp); 0: it is in none.
  int servo_priority = 0;
};

/// `network` for a process in the haptic path of a servo of that priority.
inline NetworkOptions in_haptic_path(NetworkOptions network, int servo_priority) {
  network.servo_priority = servo_priority;
  return network;
}

}  // namespace phantom::core

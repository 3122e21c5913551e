#pragma once

#include <string>
#include <vector>

#include "common/core/network.hpp"

namespace phantom::core {

/// An IPv4 address of this host.
struct HostInterface {
  std::string name;      ///< "eth0"
  std::string address;   ///< "10.30.1.2"
  bool running = false;  ///< it is up and its link carries: only such an interface is used by DDS
};

/// All IPv4 addresses of this host, whether their interfaces run or not.
std::vector<HostInterface> host_interfaces();

/// "127.0.0.1 (lo), 10.30.1.2 (eth0, not running)", or "no address".
std::string describe(const std::vector<HostInterface>& found);

/// Throws MissingError unless every address of `network.interfaces` is one in `found` that runs: DDS would go
/// on without it and find nobody. The message names the place, the address, and what this host has instead.
void require_interfaces(const NetworkOptions& network, const std::vector<HostInterface>& found);

}  // namespace phantom::core

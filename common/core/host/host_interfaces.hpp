#pragma once

#include <string>
#include <vector>

#include "common/core/network.hpp"

namespace phantom::core {

/// Returns the name of this host, as component_status gives it.
std::string host_name();

/// An IPv4 address of this host.
struct HostInterface {
  std::string name;      ///< "eth0"
  std::string address;   ///< "10.30.1.2"
  bool running = false;  ///< up, with a working link: DDS uses only such interfaces
};

/// Returns all IPv4 addresses of this host, whether their interfaces run or not.
std::vector<HostInterface> host_interfaces();

/// Lists the addresses: "127.0.0.1 (lo), 10.30.1.2 (eth0, not running)", or "no address".
std::string describe(const std::vector<HostInterface>& found);

/// Throws MissingError unless every address of `network.interfaces` is in `found` and runs. Without this
/// check DDS would start without that interface and discover nobody. The message names the place in the file,
/// the address, and the addresses that this host has.
void require_interfaces(const NetworkOptions& network, const std::vector<HostInterface>& found);

}  // namespace phantom::core

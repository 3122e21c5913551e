#include "common/core/host/host_interfaces.hpp"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <unistd.h>

#include <algorithm>

#include "common/core/errors.hpp"
#include "common/core/text.hpp"

namespace phantom::core {

std::string host_name() {
  char name[65] = {};
  gethostname(name, sizeof name - 1);
  return name;
}

std::vector<HostInterface> host_interfaces() {
  std::vector<HostInterface> found;
  ifaddrs* list = nullptr;
  if (getifaddrs(&list) != 0) return found;
  for (const ifaddrs* entry = list; entry != nullptr; entry = entry->ifa_next) {
    if (entry->ifa_addr == nullptr || entry->ifa_addr->sa_family != AF_INET) continue;
    char text[INET_ADDRSTRLEN] = {};
    inet_ntop(AF_INET, &reinterpret_cast<const sockaddr_in*>(entry->ifa_addr)->sin_addr, text, sizeof text);
    found.push_back({entry->ifa_name, text, (entry->ifa_flags & IFF_RUNNING) != 0});
  }
  freeifaddrs(list);
  return found;
}

std::string describe(const std::vector<HostInterface>& found) {
  if (found.empty()) return "no address";
  return listed(found, [](const HostInterface& one) {
    return one.address + " (" + one.name + (one.running ? ")" : ", not running)");
  });
}

void require_interfaces(const NetworkOptions& network, const std::vector<HostInterface>& found) {
  const std::string place =
      network.interfaces_place.empty() ? "network.interfaces" : network.interfaces_place;
  for (const std::string& wanted : network.interfaces) {
    const auto at = std::find_if(found.begin(), found.end(),
                                 [&](const HostInterface& has) { return has.address == wanted; });
    if (at == found.end())
      throw MissingError(place + ": " + wanted + " is no address of this host, which has " + describe(found) +
                         "; give it the address, or correct the topology");
    if (!at->running)
      throw MissingError(place + ": " + wanted + " is there, but its interface " + at->name +
                         " is down or without a link; this host has " + describe(found) +
                         "; look at the cable, and: ip link set " + at->name + " up");
  }
}

}  // namespace phantom::core

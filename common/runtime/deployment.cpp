#include "common/runtime/deployment.hpp"

#include <arpa/inet.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cctype>

#include "common/core/host_interfaces.hpp"
#include "common/runtime/config_reader.hpp"

namespace phantom::runtime {
namespace {

bool is_ipv4(const std::string& text) {
  in_addr address{};
  return inet_pton(AF_INET, text.c_str(), &address) == 1;
}

std::vector<std::string> addresses(const ConfigReader& section, const std::string& key) {
  if (!section.has(key)) return {};
  std::vector<std::string> all = section.texts(key);
  for (const std::string& address : all) {
    if (!is_ipv4(address))
      throw section.error(key, "'" + address + "' is no address; allowed: IPv4, as 10.0.1.2");
  }
  return all;
}

void check_server(const ConfigReader& section, const std::string& server) {
  const auto colon = server.rfind(':');
  const std::string port = colon == std::string::npos ? "" : server.substr(colon + 1);
  const bool digits =
      !port.empty() && port.size() <= 5 && port.find_first_not_of("0123456789") == std::string::npos;
  if (!digits || std::stoi(port) < 1 || std::stoi(port) > 65535 || !is_ipv4(server.substr(0, colon)))
    throw section.error("discovery_servers",
                        "'" + server + "' is no server; allowed: IPv4 address and port, as 10.0.1.2:11811");
}

// A plain name without wildcards: a cell that wrote into several partitions would be heard by its neighbours.
std::string partition(const ConfigReader& section) {
  if (!section.has("partition")) return "";
  const std::string name = section.text("partition");
  const bool plain = std::all_of(name.begin(), name.end(), [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '_' || c == '-' || c == '.' || c == '/';
  });
  if (name.empty() || name.size() > 64 || !plain)
    throw section.error("partition",
                        "'" + name + "' is no name of a partition; allowed: 1 to 64 of A-Z a-z 0-9 _ - . /");
  return name;
}

void read_network(const ConfigReader& section, core::NetworkOptions& net) {
  net.interfaces = addresses(section, "interfaces");
  net.interfaces_place = section.place() + ".interfaces";
  net.partition = partition(section);
  net.initial_peers = addresses(section, "initial_peers");
  net.participants_per_host =
      section.integer("participants_per_host", net.participants_per_host, {1, 115, ""});
  if (section.has("discovery_servers")) net.discovery_servers = section.texts("discovery_servers");
  for (const std::string& server : net.discovery_servers) check_server(section, server);
  // Topologies of earlier versions have this key.
  if (section.flag("shared_memory", false))
    spdlog::warn(
        "{}.shared_memory has no effect any more: with it, "
        "who was killed and started again was not heard by all",
        section.place());
  if (section.has("security")) net.security = section.path("security");
  if (net.discovery_servers.empty()) return;
  if (!net.security.empty())
    throw section.error(
        "discovery_servers",
        "do not work together with security in this Fast DDS; allowed: initial_peers instead");
  if (!net.initial_peers.empty())
    throw section.error("discovery_servers", "and initial_peers exclude each other; allowed: one of the two");
}

DeployedHost read_host(const ConfigReader& section) {
  DeployedHost host{
      section.text("name"), {}, addresses(section, "interfaces"), section.place() + ".interfaces"};
  for (const auto& item : section.sections("processes")) {
    DeployedProcess process;
    process.component = item.text("component");
    process.name = item.text("name", process.component);
    for (const auto& other : host.processes) {
      if (other.name == process.name)
        throw item.error(
            "name", "'" + process.name + "' is there already; allowed: each name once per host (key name)");
    }
    if (item.has("config")) process.config = item.path("config");
    process.on_topics = item.flag("on_topics", true);
    if (item.has("arguments")) process.arguments = item.texts("arguments");
    process.nice = item.integer("nice", 0, {-20, 19, ""});
    host.processes.push_back(std::move(process));
  }
  return host;
}

// Returns the host that the options name, or the one whose interfaces this machine has. Null if no host has
// interfaces of its own, or in a check.
const DeployedHost* this_host(const Deployment& deployment, const ProcessOptions& options) {
  std::string known;
  for (const DeployedHost& host : deployment.hosts) {
    if (!options.host.empty() && host.name == options.host) return &host;
    known += (known.empty() ? "" : ", ") + host.name;
  }
  if (!options.host.empty())
    throw ConfigError(deployment.file.string() + ": hosts: no host called '" + options.host +
                      "'; allowed: " + known);
  const auto pinned = [](const DeployedHost& host) { return !host.interfaces.empty(); };
  if (options.check || std::none_of(deployment.hosts.begin(), deployment.hosts.end(), pinned)) return nullptr;
  const std::vector<core::HostInterface> own = core::host_interfaces();
  for (const DeployedHost& host : deployment.hosts) {
    const auto here = [&](const std::string& address) {
      return std::any_of(own.begin(), own.end(), [&](const auto& has) { return has.address == address; });
    };
    if (pinned(host) && std::all_of(host.interfaces.begin(), host.interfaces.end(), here)) return &host;
  }
  throw core::MissingError(
      deployment.file.string() + ": hosts: this machine has no host's interfaces: it has " +
      core::describe(own) +
      "; give it its address, say by --host which one it is, or correct the addresses; allowed: " + known);
}

}  // namespace

Deployment load_deployment(const ProcessOptions& options) {
  const ConfigReader file = ConfigReader::from_file(options.deployment);
  Deployment deployment;
  deployment.file = options.deployment;
  deployment.name = file.text("name");
  core::NetworkOptions& net = deployment.network;
  net.domain = file.integer("domain", {0, 232, ""});
  if (options.domain >= 0) net.domain = options.domain;
  net.qos_profiles = file.path("qos_profiles");
  deployment.cell = file.path("cell");
  read_network(file.optional_section("network"), net);
  for (const auto& section : file.sections("hosts")) deployment.hosts.push_back(read_host(section));
  file.finish();
  if (const DeployedHost* host = this_host(deployment, options); host != nullptr) {
    deployment.host = host->name;
    if (!host->interfaces.empty()) {
      net.interfaces = host->interfaces;
      net.interfaces_place = host->interfaces_place;
    }
  }
  return deployment;
}

}  // namespace phantom::runtime

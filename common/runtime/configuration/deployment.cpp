#include "common/runtime/configuration/deployment.hpp"

#include <arpa/inet.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <regex>

#include "common/core/host/host_interfaces.hpp"
#include "common/core/text.hpp"
#include "common/runtime/configuration/fields.hpp"
#include "common/runtime/configuration/named.hpp"

namespace phantom::runtime {
namespace {

bool is_ipv4(const std::string& text) {
  in_addr address{};
  return inet_pton(AF_INET, text.c_str(), &address) == 1;
}

void read_addresses(const Fields& fields, const std::string& key, std::vector<std::string>& all) {
  fields.texts(key, all);
  for (const std::string& address : all)
    fields.check(is_ipv4(address), key, "'" + address + "' is no address; allowed: IPv4, as 10.0.1.2");
}

void check_server(const Fields& fields, const std::string& server) {
  std::smatch parts;
  const bool sound = std::regex_match(server, parts, std::regex("(.*):([0-9]{1,5})")) && is_ipv4(parts[1]) &&
                     std::stoi(parts[2]) >= 1 && std::stoi(parts[2]) <= 65535;
  fields.check(sound, "discovery_servers",
               "'" + server + "' is no server; allowed: IPv4 address and port, as 10.0.1.2:11811");
}

// A plain name without wildcards: a cell that wrote into several partitions would be heard by its neighbours.
void read_partition(const Fields& fields, std::string& name) {
  fields.text("partition", name);
  const bool plain = std::regex_match(name, std::regex("[A-Za-z0-9_.\\-/]{1,64}"));
  fields.check(plain || !fields.has("partition"), "partition",
               "is no name of a partition; allowed: 1 to 64 of A-Z a-z 0-9 _ - . /");
}

void read_network(const Fields& fields, core::NetworkOptions& net) {
  read_addresses(fields, "interfaces", net.interfaces);
  net.interfaces_place = fields.place() + ".interfaces";
  read_partition(fields, net.partition);
  read_addresses(fields, "initial_peers", net.initial_peers);
  fields.number("participants_per_host", net.participants_per_host);
  fields.texts("discovery_servers", net.discovery_servers);
  for (const std::string& server : net.discovery_servers) check_server(fields, server);
  bool shared_memory = false;  // topologies of earlier versions have this key
  fields.flag("shared_memory", shared_memory);
  if (shared_memory)
    spdlog::warn(
        "{}.shared_memory no longer has an effect: with it, "
        "a restarted process was not received by all",
        fields.place());
  net.security = fields.path("security");
  if (net.discovery_servers.empty()) return;
  fields.check(net.security.empty(), "discovery_servers",
               "do not work together with security in this Fast DDS; allowed: initial_peers instead");
  fields.check(net.initial_peers.empty(), "discovery_servers",
               "and initial_peers exclude each other; allowed: one of the two");
}

DeployedHost read_host(const Fields& fields) {
  DeployedHost host{.name = fields.text("name"), .interfaces_place = fields.place() + ".interfaces"};
  read_addresses(fields, "interfaces", host.interfaces);
  for (const Fields& item : fields.sections("processes")) {
    DeployedProcess process{
        .component = item.text("component"), .config = item.path("config"), .cell = item.path("cell")};
    item.check(process.component != "phantom_session", "component",
               "starts what is listed here; allowed: the processes of a session");
    read_partition(item, process.partition);
    process.name = process.component;
    item.text("name", process.name);
    item.check(
        std::ranges::find(host.processes, process.name, &DeployedProcess::name) == host.processes.end(),
        "name", "'" + process.name + "' is there already; allowed: each name once per host (key name)");
    process.place = item.place();
    item.flag("on_topics", process.on_topics);
    item.flag("simulation", process.simulation);
    item.texts("arguments", process.arguments);
    item.number("nice", process.nice);
    host.processes.push_back(std::move(process));
  }
  return host;
}

// Returns the host that the options name, or the one whose interfaces this machine has. Null if no host has
// interfaces of its own, or in a check.
const DeployedHost* this_host(const Deployment& deployment, const ProcessOptions& options) {
  const std::string place = deployment.file.string() + ": hosts: ";
  if (!options.host.empty())
    return &find_named(deployment.hosts, options.host, place + "no host called '" + options.host + "'");
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
      place + "this machine has no host's interfaces: it has " + core::describe(own) +
      "; give it its address, say by --host which one it is, or correct the addresses; allowed: " +
      core::listed(deployment.hosts, &DeployedHost::name));
}

bool say_the_same(const DeployedProcess& a, const DeployedProcess& b) {
  return a.component == b.component && a.config == b.config && a.cell == b.cell &&
         a.partition == b.partition && a.arguments == b.arguments && a.simulation == b.simulation;
}

// The entry of `name` on the host; on any host, if that is not known.
std::optional<DeployedProcess> own_entry(const Deployment& deployment, const std::string& name) {
  const DeployedProcess* own = nullptr;
  for (const DeployedHost& host : deployment.hosts) {
    if (!deployment.host.empty() && host.name != deployment.host) continue;
    const auto found = std::ranges::find(host.processes, name, &DeployedProcess::name);
    if (found == host.processes.end()) continue;
    if (own != nullptr && !say_the_same(*own, *found))
      throw ConfigError(found->place + ": " + name + " is another one here than at " + own->place +
                        "; say by --host which host this is; allowed: " +
                        core::listed(deployment.hosts, &DeployedHost::name));
    own = &*found;
  }
  return own != nullptr ? std::optional(*own) : std::nullopt;
}

}  // namespace

Deployment load_deployment(const ProcessOptions& options) {
  const Fields file(options.deployment, {kTopologyKeys});
  Deployment deployment{.name = file.text("name"), .file = options.deployment, .cell = file.path("cell")};
  core::NetworkOptions& net = deployment.network;
  file.number("domain", net.domain);
  if (options.domain >= 0) net.domain = options.domain;
  net.qos_profiles = file.path("qos_profiles");
  deployment.qos_place = file.error("qos_profiles", "is not there").what();
  deployment.cell_place = file.error("cell", "is not there").what();
  read_network(file.section("network"), net);
  for (const Fields& section : file.sections("hosts")) deployment.hosts.push_back(read_host(section));
  file.finish();
  if (const DeployedHost* host = this_host(deployment, options); host != nullptr) {
    deployment.host = host->name;
    if (!host->interfaces.empty()) {
      net.interfaces = host->interfaces;
      net.interfaces_place = host->interfaces_place;
    }
  }
  deployment.own = own_entry(deployment, options.name.empty() ? options.component : options.name);
  if (deployment.own && !deployment.own->cell.empty()) {
    deployment.cell = deployment.own->cell;
    deployment.cell_place = deployment.own->place + ".cell: is not there";
  }
  if (deployment.own && !deployment.own->partition.empty()) net.partition = deployment.own->partition;
  return deployment;
}

// A topology that was copied elsewhere names files by paths that lead nowhere from there.
void require_files(const Deployment& deployment) {
  const auto require = [](const std::filesystem::path& path, const std::string& place) {
    if (path.empty() || std::filesystem::exists(path)) return;
    throw core::MissingError(place + " (" + path.string() +
                             "); relative paths begin at the topology's folder");
  };
  require(deployment.network.qos_profiles, deployment.qos_place);
  require(deployment.cell, deployment.cell_place);
}

void require_simulation_meant(const Deployment& deployment, const ProcessOptions& options,
                              const std::string& setting) {
  if (deployment.own && deployment.own->simulation) return;
  const std::string name = options.name.empty() ? options.component : options.name;
  const std::string what =
      deployment.own
          ? deployment.own->place + ": " + name + " does not say simulation: true"
          : deployment.file.string() + " has no process " + name + " here that says simulation: true";
  throw ConfigError(
      setting + ", but " + what +
      "; allowed: that, where simulation is meant, or parameters (key config) that simulate nothing");
}

}  // namespace phantom::runtime

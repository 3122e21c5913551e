#include "common/runtime/deployment.hpp"

#include "common/runtime/config_reader.hpp"

namespace phantom::runtime {

Deployment load_deployment(const ProcessOptions& options) {
  const auto& path = options.deployment;
  const ConfigReader file = ConfigReader::from_file(path);
  Deployment deployment;
  deployment.file = path;
  deployment.name = file.text("name");
  core::NetworkOptions& net = deployment.network;
  net.domain = file.integer("domain", {0, 232, ""});
  if (options.domain >= 0) net.domain = options.domain;
  net.qos_profiles = file.path("qos_profiles");
  deployment.cell = file.path("cell");
  const ConfigReader network = file.optional_section("network");
  if (network.has("interfaces")) net.interfaces = network.texts("interfaces");
  if (network.has("initial_peers")) net.initial_peers = network.texts("initial_peers");
  net.shared_memory = network.flag("shared_memory", false);
  for (const auto& host_section : file.sections("hosts")) {
    DeployedHost host{host_section.text("name"), {}};
    for (const auto& item : host_section.sections("processes")) {
      DeployedProcess process;
      process.component = item.text("component");
      process.name = item.text("name", process.component);
      for (const auto& other : host.processes) {
        if (other.name == process.name)
          throw item.error("name", "'" + process.name +
                                       "' is there already; allowed: each name once per host (key name)");
      }
      if (item.has("config")) process.config = item.path("config");
      process.on_topics = item.flag("on_topics", true);
      if (item.has("arguments")) process.arguments = item.texts("arguments");
      process.nice = item.integer("nice", 0, {-20, 19, ""});
      host.processes.push_back(std::move(process));
    }
    deployment.hosts.push_back(std::move(host));
  }
  file.finish();
  return deployment;
}

}  // namespace phantom::runtime

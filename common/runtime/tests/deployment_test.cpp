#include "common/runtime/configuration/deployment.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>

#include "common/runtime/configuration/fields.hpp"
#include "tests/support/files.hpp"

namespace phantom::runtime {
namespace {

TEST(Deployment, ShippedTopologiesLoad) {
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(PHANTOM_SOURCE_DIR "/deploy/topologies")) {
    ProcessOptions options;
    options.deployment = entry.path();
    options.check = true;  // on none of its hosts
    const Deployment deployment = load_deployment(options);
    EXPECT_TRUE(std::filesystem::is_regular_file(deployment.network.qos_profiles)) << entry.path();
    EXPECT_FALSE(deployment.hosts.empty()) << entry.path();
    ++count;
  }
  EXPECT_GE(count, 1);
}

TEST(Deployment, TheCommandLinesDomainWins) {
  ProcessOptions options;
  options.deployment = PHANTOM_SOURCE_DIR "/deploy/topologies/single_host.yaml";
  EXPECT_EQ(load_deployment(options).network.domain, 42);
  options.domain = 7;
  EXPECT_EQ(load_deployment(options).network.domain, 7);
}

TEST(Deployment, AProcessMayHaveANameAndAConfigurationOfItsOwn) {
  ProcessOptions options;
  options.deployment = PHANTOM_SOURCE_DIR "/deploy/topologies/can_drives.yaml";
  const Deployment deployment = load_deployment(options);
  int drives = 0;
  for (const DeployedProcess& process : deployment.hosts.at(0).processes) {
    if (process.component != "simulated_drive") {
      EXPECT_EQ(process.name, process.component);
      EXPECT_TRUE(process.on_topics);
      continue;
    }
    ++drives;
    EXPECT_NE(process.name, process.component);
    EXPECT_FALSE(process.on_topics);
    EXPECT_TRUE(std::filesystem::is_regular_file(process.config)) << process.config;
  }
  EXPECT_EQ(drives, 2);
}

TEST(Deployment, TwoProcessesOfOneNameAreRefused) {
  ProcessOptions options;
  options.deployment = test::new_file(
      "name: x\ndomain: 5\nqos_profiles: q.xml\ncell: c.yaml\nhosts:\n- name: a\n  processes:\n"
      "  - {component: simulated_drive}\n  - {component: simulated_drive}\n");
  EXPECT_THAT([&] { load_deployment(options); },
              testing::ThrowsMessage<ConfigError>(testing::HasSubstr("'simulated_drive' is there already")));
}

// A topology that was copied out of deploy/ names files that are not there.
TEST(Deployment, AFileThatIsNotThereIsNamedByTheTopologysLine) {
  ProcessOptions options;
  options.deployment = test::new_file("name: x\ndomain: 5\nqos_profiles: q.xml\ncell: c.yaml\n");
  EXPECT_THAT([&] { require_files(load_deployment(options)); },
              testing::ThrowsMessage<core::MissingError>(
                  testing::AllOf(testing::HasSubstr(":3: qos_profiles: 'q.xml' is not there ("),
                                 testing::HasSubstr("relative paths begin at the topology's folder"))));
  const auto there = options.deployment.string();
  options.deployment = test::new_file("name: x\ndomain: 5\nqos_profiles: " + there + "\ncell: c.yaml\n");
  EXPECT_THAT(
      [&] { require_files(load_deployment(options)); },
      testing::ThrowsMessage<core::MissingError>(testing::HasSubstr(":4: cell: 'c.yaml' is not there (")));
  options.deployment =
      test::new_file("name: x\ndomain: 5\nqos_profiles: " + there + "\ncell: " + there + "\n");
  EXPECT_NO_THROW(require_files(load_deployment(options)));
}

TEST(Deployment, FaultsAreNamed) {
  ProcessOptions options;
  options.deployment = test::new_file("name: x\ndomain: 500\nqos_profiles: q.xml\ncell: c.yaml\n");
  EXPECT_THAT([&] { load_deployment(options); },
              testing::ThrowsMessage<ConfigError>(
                  testing::HasSubstr(":2: domain: '500' is out of range; allowed: 0 to 232")));
}

// A topology from text, in a file of this process's own.
class NetworkText : public testing::Test {
 protected:
  Deployment load(const std::string& text, ProcessOptions options = {}) {
    options.deployment = test::new_file("name: x\ndomain: 5\nqos_profiles: q.xml\ncell: c.yaml\n" + text);
    return load_deployment(options);
  }
  void refuses(const std::string& text, const std::string& message) {
    EXPECT_THAT([&] { load(text); }, testing::ThrowsMessage<ConfigError>(testing::HasSubstr(message)));
  }
};

constexpr const char* kTwoHosts =
    "network: {interfaces: [127.0.0.1]}\n"
    "hosts:\n- {name: here, interfaces: [127.0.0.1]}\n- {name: there, interfaces: [192.0.2.7]}\n";

TEST_F(NetworkText, AHostIsFoundByItsInterfacesUnlessItIsNamed) {
  EXPECT_THAT(load(kTwoHosts).network.interfaces, testing::ElementsAre("127.0.0.1"));
  EXPECT_EQ(load(kTwoHosts).host, "here");
  EXPECT_THAT(load(kTwoHosts, {.host = "there"}).network.interfaces, testing::ElementsAre("192.0.2.7"));
  EXPECT_THAT(load(kTwoHosts, {.host = "there"}).network.interfaces_place,
              testing::EndsWith(":8: hosts[1].interfaces"));
  EXPECT_THAT(load("network: {interfaces: [127.0.0.1]}\n").network.interfaces_place,
              testing::EndsWith(":5: network.interfaces"));
  EXPECT_THAT([&] { load(kTwoHosts, {.host = "elsewhere"}); },
              testing::ThrowsMessage<ConfigError>(
                  testing::HasSubstr("no host called 'elsewhere'; allowed: here, there")));
}

TEST_F(NetworkText, ASessionIsNoneOfItsProcesses) {
  refuses("hosts: [{name: here, processes: [{component: phantom_session, name: me}]}]\n",
          "hosts[0].processes[0].component: 'phantom_session' starts what is listed here");
}

TEST_F(NetworkText, AProcessFindsItsEntryByNameAndHost) {
  const std::string hosts =
      "hosts:\n- name: here\n  processes:\n  - {component: slave_io, config: a.yaml, simulation: true}\n"
      "  - {component: simulated_drive, name: drives, config: d.yaml}\n"
      "- name: there\n  processes:\n  - {component: slave_io, config: b.yaml}\n  - {component: wva_server}\n";
  const Deployment here = load(hosts, {.component = "slave_io", .host = "here"});
  ASSERT_TRUE(here.own);
  EXPECT_EQ(here.own->config.filename(), "a.yaml");
  EXPECT_TRUE(here.own->simulation);
  EXPECT_THAT(here.own->place, testing::EndsWith(":8: hosts[0].processes[0]"));
  EXPECT_FALSE(load(hosts, {.component = "slave_io", .host = "there"}).own->simulation);
  EXPECT_FALSE(load(hosts, {.component = "simulated_drive", .host = "here"}).own);
  EXPECT_EQ(
      load(hosts, {.component = "simulated_drive", .name = "drives", .host = "here"}).own->config.filename(),
      "d.yaml");
  // Where the host is not known: what all say alike.
  EXPECT_TRUE(load(hosts, {.component = "wva_server"}).own);
  EXPECT_FALSE(load(hosts, {.component = "dds_spy"}).own);
  EXPECT_THAT([&] { load(hosts, {.component = "slave_io"}); },
              testing::ThrowsMessage<ConfigError>(testing::AllOf(
                  testing::HasSubstr(":12: hosts[1].processes[0]: slave_io is another one here than at "),
                  testing::HasSubstr("say by --host which host this is; allowed: here, there"))));
}

TEST_F(NetworkText, WhoSimulatesIsTheOneThatTheTopologyMeans) {
  const auto simulates = [&](const std::string& entry) {
    const ProcessOptions options{.component = "slave_io"};
    const Deployment deployment = load("hosts: [{name: a, processes: [" + entry + "]}]\n", options);
    require_simulation_meant(deployment, options, "x.yaml: driver: sim");
  };
  EXPECT_NO_THROW(simulates("{component: slave_io, simulation: true}"));
  for (const char* entry : {"{component: slave_io}", "{component: slave_io, simulation: false}"})
    EXPECT_THAT(
        [&] { simulates(entry); },
        testing::ThrowsMessage<ConfigError>(testing::AllOf(
            testing::StartsWith("x.yaml: driver: sim, but "), testing::HasSubstr("hosts[0].processes[0]"),
            testing::HasSubstr("does not say simulation: true"), testing::HasSubstr("allowed: "))));
  EXPECT_THAT([&] { simulates("{component: wva_server}"); },
              testing::ThrowsMessage<ConfigError>(testing::HasSubstr("has no process slave_io here")));
}

TEST_F(NetworkText, AMachineThatIsNoneOfTheHostsJoinsNothing) {
  const std::string elsewhere = "hosts:\n- {name: there, interfaces: [192.0.2.7]}\n";
  EXPECT_THAT([&] { load(elsewhere); },
              testing::ThrowsMessage<core::MissingError>(testing::AllOf(
                  testing::HasSubstr("this machine has no host's interfaces: it has"),
                  testing::HasSubstr("127.0.0.1 (lo)"), testing::HasSubstr("allowed: there"))));
  EXPECT_NO_THROW(load(elsewhere, {.check = true}));
}

TEST_F(NetworkText, PeersServersAndSecurityAreRead) {
  const Deployment deployment = load(
      "network: {initial_peers: [192.0.2.1, 192.0.2.2], participants_per_host: 12, security: ../keys}\n");
  EXPECT_THAT(deployment.network.initial_peers, testing::ElementsAre("192.0.2.1", "192.0.2.2"));
  EXPECT_EQ(deployment.network.participants_per_host, 12);
  EXPECT_EQ(deployment.network.security, test::own_folder() / "../keys");
  EXPECT_THAT(load("network: {discovery_servers: ['192.0.2.1:11811']}\n").network.discovery_servers,
              testing::ElementsAre("192.0.2.1:11811"));
}

TEST_F(NetworkText, APartitionIsANameAndNoPattern) {
  EXPECT_EQ(load("network: {partition: hall_2/cell-7}\n").network.partition, "hall_2/cell-7");
  EXPECT_EQ(load("").network.partition, "");
  for (const char* pattern : {"'cell_*'", "'cell_?'", "'[ab]'", "''"})
    refuses("network: {partition: " + std::string(pattern) + "}\n",
            "is no name of a partition; allowed: 1 to 64 of");
}

TEST_F(NetworkText, TopologiesOfEarlierVersionsThatNameSharedMemoryAreRead) {
  for (const char* wanted : {"true", "false"})
    EXPECT_EQ(load("network: {shared_memory: " + std::string(wanted) + ", partition: p}\n").network.partition,
              "p");
}

TEST_F(NetworkText, WhatCannotWorkIsRefusedInWords) {
  refuses("network: {interfaces: [eth0]}\n", ":5: network.interfaces: 'eth0' is no address");
  refuses("network: {initial_peers: [cell.example]}\n",
          "network.initial_peers: 'cell.example' is no address");
  refuses("network: {discovery_servers: [192.0.2.1]}\n",
          "'192.0.2.1' is no server; allowed: IPv4 address and port");
  refuses("network: {discovery_servers: ['192.0.2.1:70000']}\n", "'192.0.2.1:70000' is no server");
  refuses("network: {discovery_servers: ['192.0.2.1:11811'], security: keys}\n",
          "network.discovery_servers: do not work together with security");
  refuses("network: {discovery_servers: ['192.0.2.1:11811'], initial_peers: [192.0.2.1]}\n",
          "exclude each other; allowed: one of the two");
}

}  // namespace
}  // namespace phantom::runtime

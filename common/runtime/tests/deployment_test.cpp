#include "common/runtime/deployment.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>

#include "common/runtime/config_reader.hpp"

namespace phantom::runtime {
namespace {

TEST(Deployment, ShippedTopologiesLoad) {
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(PHANTOM_SOURCE_DIR "/deploy/topologies")) {
    ProcessOptions options;
    options.deployment = entry.path();
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
  options.deployment =
      std::filesystem::temp_directory_path() / ("phantom_twice_" + std::to_string(getpid()) + ".yaml");
  std::ofstream(options.deployment)
      << "name: x\ndomain: 5\nqos_profiles: q.xml\ncell: c.yaml\nhosts:\n- name: a\n  processes:\n"
         "  - {component: simulated_drive}\n  - {component: simulated_drive}\n";
  EXPECT_THAT([&] { load_deployment(options); },
              testing::ThrowsMessage<ConfigError>(testing::HasSubstr("'simulated_drive' is there already")));
  std::filesystem::remove(options.deployment);
}

TEST(Deployment, FaultsAreNamed) {
  ProcessOptions options;
  options.deployment =
      std::filesystem::temp_directory_path() / ("phantom_topology_" + std::to_string(getpid()) + ".yaml");
  std::ofstream(options.deployment) << "name: x\ndomain: 500\nqos_profiles: q.xml\ncell: c.yaml\n";
  EXPECT_THAT([&] { load_deployment(options); },
              testing::ThrowsMessage<ConfigError>(
                  testing::HasSubstr(":2: domain: '500' is out of range; allowed: 0 to 232")));
  std::filesystem::remove(options.deployment);
}

}  // namespace
}  // namespace phantom::runtime

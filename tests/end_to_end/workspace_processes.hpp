#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iostream>
#include <optional>
#include <string>
#include <vector>

#include "tests/end_to_end/running_system.hpp"
#include "tests/end_to_end/workspace_observer.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/own_domain.hpp"

namespace phantom::end_to_end {

inline constexpr const char* kWvaServer = PHANTOM_BIN_DIR "/wva_server";
inline constexpr const char* kSensing = PHANTOM_BIN_DIR "/phantom_sensing";

/// `wva_server command …` as a person would type it.
inline test::Said command(const std::string& words, const std::string& deployment, int domain) {
  return test::run_line(std::string(kWvaServer) + " command " + words + " --timeout-s 30 --deployment " +
                        deployment + " --domain " + std::to_string(domain));
}

/// The version that a command's answer names; 0: none.
inline std::uint64_t version_in(const std::string& output) {
  const auto at = output.find("\nversion ");
  return at == std::string::npos ? 0 : std::stoull(output.substr(at + 9));
}

/// wva_server and phantom_sensing alone, as processes that a test may kill.
class Processes : public testing::Test {
 protected:
  void SetUp() override { std::filesystem::create_directories(folder_); }
  void TearDown() override {
    sensing_.reset();
    server_.reset();
    if (HasFailure()) std::cerr << read_text(folder_ / "server.log") << read_text(folder_ / "sensing.log");
    std::filesystem::remove_all(folder_);
  }
  std::string topology(const std::string& name, const std::string& interfaces) {
    const std::string source = PHANTOM_SOURCE_DIR;
    std::ofstream(folder_ / name) << "name: test\ndomain: " << domain_ << "\nqos_profiles: " << source
                                  << "/deploy/qos/phantom.xml\ncell: " << source
                                  << "/deploy/cells/hot_cell/cell.yaml\nnetwork: {interfaces: [" << interfaces
                                  << "]}\n";
    return (folder_ / name).string();
  }
  core::NetworkOptions network(std::vector<std::string> interfaces) const {
    core::NetworkOptions network;
    network.domain = domain_;
    network.qos_profiles = PHANTOM_SOURCE_DIR "/deploy/qos/phantom.xml";
    network.interfaces = std::move(interfaces);
    return network;
  }
  void start_server(const std::string& deployment, const std::vector<std::string>& more = {}) {
    std::vector<std::string> words{kWvaServer, "--deployment", deployment};
    words.insert(words.end(), more.begin(), more.end());
    server_.emplace(std::move(words), folder_ / "server.log");
  }
  void start_sensing(const std::string& deployment, std::vector<std::string> in_front = {}) {
    for (const char* word : {kSensing, "--deployment", deployment.c_str()}) in_front.push_back(word);
    sensing_.emplace(std::move(in_front), folder_ / "sensing.log");
  }
  static std::string move_to(double y_m) {
    return "move --object pump --pose '0.4 " + std::to_string(y_m) + " 0.301 0 0 15'";
  }

  std::filesystem::path folder_ =
      std::filesystem::temp_directory_path() / ("phantom_change_" + std::to_string(getpid()));
  int domain_ = test::own_domain();
  std::optional<test::Process> server_, sensing_;
};

}  // namespace phantom::end_to_end

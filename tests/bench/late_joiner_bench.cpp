// From the start of the real wva_server to the moment at which a consumer that joins once everything is
// published holds the whole cell, over DDS on the loopback interface.
#include <benchmark/benchmark.h>
#include <fcntl.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>
#include <yaml-cpp/yaml.h>

#include <filesystem>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/core/clock.hpp"
#include "common/dds/endpoints/endpoint.hpp"
#include "common/messages/codecs/workspace_codec.hpp"
#include "components/phantom_sensing/workspace/workspace_subscriber.hpp"
#include "tests/bench/repetitions.hpp"

namespace phantom::bench {
namespace {

using benchmark::State;

double now_s() { return core::seconds(core::monotonic_ns()); }

/// The shipped hot cell with voxels of another size and layers as thick as before, and a topology for it, in
/// a folder of their own.
class Cell {
 public:
  explicit Cell(int voxel_mm) {
    std::string pattern = (std::filesystem::temp_directory_path() / "late_joiner_XXXXXX").string();
    if (mkdtemp(pattern.data()) == nullptr) throw std::runtime_error("no temporary folder");
    folder_ = pattern;
    const std::filesystem::path deploy = PHANTOM_SOURCE_DIR "/deploy";
    std::filesystem::create_directory_symlink(deploy / "cells/hot_cell/meshes", folder_ / "meshes");
    for (const auto& entry : std::filesystem::directory_iterator(deploy / "cells/hot_cell")) {
      if (!std::filesystem::exists(folder_ / entry.path().filename()))
        std::filesystem::create_symlink(entry.path(), folder_ / entry.path().filename());
    }
    YAML::Node cell = YAML::LoadFile(folder_ / "cell.yaml");
    cell["workspace"]["voxel_size_m"] = voxel_mm * 1e-3;
    cell["profile"]["thickness_vox"] = std::vector<int>(6, 20 / voxel_mm);
    std::filesystem::remove(folder_ / "cell.yaml");
    std::ofstream(folder_ / "cell.yaml") << cell;
    YAML::Node topology = YAML::LoadFile(deploy / "topologies/single_host.yaml");
    topology["cell"] = (folder_ / "cell.yaml").string();
    topology["qos_profiles"] = (deploy / "qos/phantom.xml").string();
    std::ofstream(folder_ / "topology.yaml") << topology;
  }
  ~Cell() { std::filesystem::remove_all(folder_); }
  Cell(const Cell&) = delete;
  Cell& operator=(const Cell&) = delete;

  std::filesystem::path topology() const { return folder_ / "topology.yaml"; }
  std::filesystem::path report() const { return folder_ / "report"; }

 private:
  std::filesystem::path folder_;
};

/// wva_server as a process of its own.
class Server {
 public:
  Server(const Cell& cell, int domain) : report_(cell.report() / "wva_server.json") {
    std::filesystem::remove_all(cell.report());
    pid_ = fork();
    if (pid_ < 0) throw std::runtime_error("no process for wva_server");
    if (pid_ > 0) return;
    const int nowhere = open("/dev/null", O_WRONLY);
    dup2(nowhere, STDOUT_FILENO);
    dup2(nowhere, STDERR_FILENO);
    execl(PHANTOM_BIN_DIR "/wva_server", "wva_server", "--deployment", cell.topology().c_str(), "--domain",
          std::to_string(domain).c_str(), "--report-dir", cell.report().c_str(), nullptr);
    _exit(127);
  }
  ~Server() {
    kill(pid_, SIGTERM);
    waitpid(pid_, nullptr, 0);
  }
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  /// Waits until the cell is published; returns how long the activation took, as the server says it.
  double activation_s() const {
    for (const double from_s = now_s(); now_s() - from_s < 60; usleep(200)) {
      std::ifstream file(report_);
      const auto report = nlohmann::json::parse(file, nullptr, false);  // it may be half written
      if (!report.is_discarded()) return report.at("build_seconds").get<double>();
    }
    throw std::runtime_error("wva_server published nothing");
  }

 private:
  std::filesystem::path report_;
  pid_t pid_ = 0;
};

/// Takes the workspace in as phantom_sensing does.
class Joiner {
 public:
  explicit Joiner(const core::NetworkOptions& network) : participant_("late_joiner", network) {}

  void wait_for_whole_cell() const {
    for (const double from_s = now_s(); workspace_.version() == 0; usleep(200)) {
      if (now_s() - from_s > 60) throw std::runtime_error("the late joiner did not get the whole cell");
    }
  }

 private:
  static constexpr workspace::SourceId kServer{1};  // there is but one
  phantom_sensing::WorkspaceSubscriber workspace_{
      {.refused = [](const std::string& problem) { std::cerr << "late_joiner_bench: " << problem << '\n'; }}};
  dds::Participant participant_;
  dds::Reader<msg::WorkspaceVersion> versions_{participant_, dds::kWorkspaceVersion,
                                               [this](const auto& message, const dds::SampleInfo&) {
                                                 const auto version = messages::from_idl(message);
                                                 if (!version) return workspace_.refuse(version.status());
                                                 workspace_.commit(kServer, version->description);
                                               }};
  dds::Reader<msg::WorkspaceBrick> bricks_{
      participant_, dds::kWorkspaceBrick, [this](const auto& message, const dds::SampleInfo&) {
        const auto brick = messages::from_idl(message);
        if (!brick) return workspace_.refuse(brick.status());
        workspace_.put_brick(kServer, brick->key, brick->version,
                             {brick->voxels_zstd.begin(), brick->voxels_zstd.end()});
      }};
};

void start_to_late_joiner(State& state, int voxel_mm) {
  const Cell cell(voxel_mm);
  const int domain = 200 + static_cast<int>(getpid() % 30);
  core::NetworkOptions network{.domain = domain,
                               .qos_profiles = PHANTOM_SOURCE_DIR "/deploy/qos/phantom.xml",
                               .interfaces = {"127.0.0.1"}};
  double activation_s = 0.0, published_s = 0.0, joined_s = 0.0;
  for (auto _ : state) {
    try {  // whoever gives up leaves no server behind
      const double from_s = now_s();
      const Server server(cell, domain);
      activation_s = server.activation_s();
      published_s = now_s() - from_s;
      const double join_s = now_s();
      const Joiner joiner(network);
      joiner.wait_for_whole_cell();
      joined_s = now_s() - join_s;
    } catch (const std::exception& problem) {
      state.SkipWithError(problem.what());
      return;
    }
    state.SetIterationTime(published_s + joined_s);
  }
  state.counters["activation_s"] = activation_s;
  state.counters["start_to_published_s"] = published_s;
  state.counters["join_s"] = joined_s;
  state.counters["per_activation"] = (published_s + joined_s) / activation_s;
}

[[maybe_unused]] const bool registered = [] {
  for (const int voxel_mm : {5, 2}) {
    benchmark::RegisterBenchmark(("late_joiner/hot_cell/" + std::to_string(voxel_mm) + "mm").c_str(),
                                 start_to_late_joiner, voxel_mm)
        ->UseManualTime()
        ->Iterations(1)
        ->Repetitions(repetitions(5))
        ->Unit(benchmark::kMillisecond);
  }
  return true;
}();

}  // namespace
}  // namespace phantom::bench

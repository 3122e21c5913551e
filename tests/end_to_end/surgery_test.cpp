// An operating field in two resolutions, as shipped (deploy/topologies/surgery.yaml): the probe is felt in
// fine voxels while the process that senses it there lives, else in the coarse ones. The test plays the arm.
#include <gtest/gtest.h>

#include <atomic>
#include <csignal>
#include <filesystem>
#include <functional>
#include <iostream>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "common/dds/endpoints/endpoint.hpp"
#include "common/messages/codecs/teleoperation_codec.hpp"
#include "common/messages/publisher.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/eventually.hpp"
#include "tests/support/files.hpp"
#include "tests/support/own_domain.hpp"

namespace phantom::end_to_end {
namespace {

using test::eventually;
using test::Process;

constexpr std::size_t kArmJoints = 5;
// Of the shipped cells: the tip is at z = q3 − 0.14 m, the vessel's top at 0.127 m. Six layers of 1 mm or 8
// mm.
constexpr double kTipOverQ3_m = -0.14, kVesselTop_m = 0.127, kFineReach_m = 0.006, kCoarseReach_m = 0.048,
                 kVesselY_m = 0.0, kMovedY_m = -0.030, kMovedAgainY_m = -0.045;

class Surgery : public testing::Test {
 protected:
  Surgery() {
    std::filesystem::create_directories(folder_);
    core::NetworkOptions network;
    network.domain = domain_;
    network.qos_profiles = PHANTOM_SOURCE_DIR "/deploy/qos/phantom.xml";
    network.interfaces = {"127.0.0.1"};
    participant_.emplace("surgery_test", network);
    percepts_.emplace(*participant_, dds::kPercept,
                      [this](const msg::Percept& percept, const dds::SampleInfo&) {
                        const std::lock_guard lock(mutex_);
                        newest_ = percept;
                      });
    status_.emplace(*participant_, dds::kComponentStatus,
                    [this](const msg::ComponentStatus& sample, const dds::SampleInfo&) {
                      const std::lock_guard lock(mutex_);
                      if (sample.component_name().to_string() == "phantom_sensing_probe")
                        said_by_probe_ = sample.message().to_string();
                    });
    for (const char* name : {"wva_server", "wva_server_fine"}) servers_.push_back(start("wva_server", name));
    arm_ = start("phantom_sensing", "phantom_sensing");
    probe_ = start("phantom_sensing", "phantom_sensing_probe");
    states_.emplace(*participant_, dds::kSlaveState);
    player_ = std::jthread([this](const std::stop_token& stop) {
      while (!stop.stop_requested()) {
        messages::SlaveState state;
        state.joint_count = kArmJoints;
        state.position[0] = x_m_, state.position[1] = 0.15 + y_m_,
        state.position[2] = gap_m_ + kVesselTop_m - kTipOverQ3_m;
        state.velocity[2] = -0.001;
        states_->publish(state);
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
      }
    });
  }
  ~Surgery() override {
    player_ = {};
    if (HasFailure())
      for (const auto& log : std::filesystem::directory_iterator(folder_))
        std::cerr << log.path().filename().string() << ":\n" << test::read_text(log.path());
    probe_.reset();
    arm_.reset();
    servers_.clear();
    std::filesystem::remove_all(folder_);
  }

  std::unique_ptr<Process> start(const std::string& component, const std::string& name,
                                 const std::vector<std::string>& command = {}) const {
    std::vector<std::string> words{std::string(PHANTOM_BIN_DIR "/") + component};
    words.insert(words.end(), command.begin(), command.end());
    words.insert(words.end(), {"--deployment", PHANTOM_SOURCE_DIR "/deploy/topologies/surgery.yaml", "--name",
                               name, "--domain", std::to_string(domain_)});
    return std::make_unique<Process>(
        words, folder_ / (name + (command.empty() ? "" : "_" + command.front()) + ".log"));
  }
  /// Moves the vessel aside by a command to one server. Returns the command's exit code.
  int move_vessel(const std::string& server, double y_m) const {
    return start("wva_server", server,
                 {"command", "move", "--object", "vessel", "--pose",
                  "0 " + std::to_string(y_m) + " 0.125 0 90 0"})
        ->wait();
  }
  /// Lets the arm carry the nerve along its probe, 10 mm farther down than the tip.
  int attach_nerve() const {
    return start("wva_server", "wva_server",
                 {"command", "attach", "--object", "nerve", "--frame", "probe", "--pose", "0 0 -0.11 0 0 0"})
        ->wait();
  }
  /// Waits until the status of the probe's process has that in it, or has not.
  bool said(const std::string& text, bool whether = true) {
    return eventually([&] {
      const std::lock_guard lock(mutex_);
      return !said_by_probe_.empty() && (said_by_probe_.find(text) != std::string::npos) == whether;
    });
  }
  /// Waits until a percept is as `expected` says, with the tip that far over the vessel.
  bool felt(double gap_m, const std::function<bool(const msg::Percept&)>& expected) {
    gap_m_ = gap_m;
    return eventually([&] {
      const std::lock_guard lock(mutex_);
      return newest_.valid() && expected(newest_);
    });
  }

  const int domain_ = test::own_domain();
  const std::filesystem::path folder_ = test::new_folder();
  std::mutex mutex_;
  msg::Percept newest_;
  std::string said_by_probe_;
  std::atomic<double> gap_m_{0.02}, x_m_{0.15}, y_m_{kVesselY_m};
  std::optional<dds::Participant> participant_;
  std::optional<dds::Reader<msg::Percept>> percepts_;
  std::optional<dds::Reader<msg::ComponentStatus>> status_;
  std::vector<std::unique_ptr<Process>> servers_;
  std::unique_ptr<Process> arm_, probe_;
  std::optional<messages::Publisher<messages::SlaveState>> states_;
  std::jthread player_;
};

// Tries phantom_sensing: reaches out of its workspace
TEST_F(Surgery, TheProbeIsFeltInFineVoxelsAndInCoarseOnesWhereThereAreNoOthers) {
  const auto free_space = [](const msg::Percept& percept) { return percept.mu() == 0.0; };
  const auto in_fluid = [](const msg::Percept& percept) { return percept.mu() > 0.0; };
  const auto by_vessel = [](const msg::Percept& percept) {
    return percept.mu() > 0.0 && percept.object() == 3 && percept.link() == kArmJoints;
  };
  const double between_m = 0.5 * (kFineReach_m + kCoarseReach_m);
  EXPECT_TRUE(felt(between_m, free_space)) << "farther than the fine layers reach";
  EXPECT_TRUE(felt(0.5 * kFineReach_m, by_vessel));
  EXPECT_TRUE(felt(between_m, free_space));
  probe_->end(SIGKILL);
  EXPECT_TRUE(felt(between_m, in_fluid)) << "in the coarse layers";
  probe_ = start("phantom_sensing", "phantom_sensing_probe");
  EXPECT_TRUE(felt(between_m, free_space)) << "it is back";
  probe_->signal(SIGSTOP);
  EXPECT_TRUE(felt(between_m, in_fluid)) << "it hangs";
  probe_->signal(SIGCONT);
  EXPECT_TRUE(felt(between_m, free_space)) << "it goes on";
  servers_.back()->end(SIGKILL);
  EXPECT_TRUE(felt(0.5 * kFineReach_m, by_vessel)) << "the fine workspace stays as it was";
  servers_.back() = start("wva_server", "wva_server_fine");
  EXPECT_TRUE(felt(between_m, free_space));
  x_m_ = 0.23;  // beside the fine workspace, by the vessel's end
  EXPECT_TRUE(felt(between_m, in_fluid));
  x_m_ = 0.15;
  EXPECT_TRUE(felt(between_m, free_space));
}

// One command to the arm's wva_server: the fine one follows, and the probe feels the vessel where it is now.
TEST_F(Surgery, OneCommandMovesAnObjectInBothWorkspaces) {
  const double near_m = 0.5 * kFineReach_m;
  const auto over_vessel = [&](double y_m) {
    y_m_ = y_m;
    return felt(near_m,
                [](const msg::Percept& percept) { return percept.mu() > 0.0 && percept.object() == 3; });
  };
  const auto over_nothing = [&](double y_m) {
    y_m_ = y_m;
    return felt(near_m, [](const msg::Percept& percept) { return percept.mu() == 0.0; });
  };
  ASSERT_TRUE(over_vessel(kVesselY_m));
  ASSERT_TRUE(over_nothing(kMovedY_m)) << "30 mm aside nothing is felt in fine voxels";
  ASSERT_EQ(move_vessel("wva_server", kMovedY_m), 0);
  EXPECT_TRUE(over_vessel(kMovedY_m)) << "the fine workspace follows";
  EXPECT_TRUE(over_nothing(kVesselY_m));
  EXPECT_TRUE(said("OBJECTS STAND ELSEWHERE", false));
  EXPECT_NE(move_vessel("wva_server_fine", kMovedY_m), 0) << "the fine one takes no commands of its own";
  EXPECT_NE(test::read_text(folder_ / "wva_server_fine_command.log").find("send the command there"),
            std::string::npos);
  servers_.back()->end(SIGKILL);
  ASSERT_EQ(move_vessel("wva_server", kMovedAgainY_m), 0) << "which the fine one misses";
  servers_.back() = start("wva_server", "wva_server_fine");
  EXPECT_TRUE(over_vessel(kMovedAgainY_m)) << "a restarted one serves its cell file, and follows";
  EXPECT_TRUE(over_nothing(kMovedY_m));
}

// Tries phantom_sensing: an object stands elsewhere in a share's workspace than in the arm's
TEST_F(Surgery, AnObjectThatStandsElsewhereInOneWorkspaceIsTold) {
  const std::string warning = "OBJECTS STAND ELSEWHERE";
  ASSERT_TRUE(felt(0.5 * (kFineReach_m + kCoarseReach_m), [](const msg::Percept& percept) {
    return percept.mu() == 0.0;
  })) << "in fine voxels";
  ASSERT_TRUE(said("senses share probe"));
  EXPECT_TRUE(said(warning, false)) << "as shipped they stand alike";
  servers_.back()->end(SIGKILL);  // nothing follows
  ASSERT_EQ(move_vessel("wva_server", kMovedY_m), 0);
  EXPECT_TRUE(said("move them in both: vessel"));
  servers_.back() = start("wva_server", "wva_server_fine");
  EXPECT_TRUE(said(warning, false));
}

TEST_F(Surgery, WhatTheProbeCarriesIsFeltInFineVoxelsOnceBothWorkspacesHaveItCarried) {
  const auto free_space = [](const msg::Percept& percept) { return percept.mu() == 0.0; };
  const auto by_vessel = [](const msg::Percept& percept) {
    return percept.mu() > 0.0 && percept.object() == 3 && percept.link() == kArmJoints;
  };
  const double farther_m = 0.010, between_m = 0.5 * (kFineReach_m + kCoarseReach_m);
  ASSERT_TRUE(felt(0.5 * kFineReach_m + farther_m, free_space)) << "the tip alone";
  servers_.back()->end(SIGKILL);  // nothing follows
  ASSERT_EQ(attach_nerve(), 0);
  EXPECT_TRUE(felt(between_m, [](const msg::Percept& percept) { return percept.mu() > 0.0; }))
      << "in the coarse voxels, as the fine ones lack it";
  EXPECT_TRUE(said("move them in both: nerve"));
  servers_.back() = start("wva_server", "wva_server_fine");
  EXPECT_TRUE(felt(between_m, free_space)) << "in the fine ones, whose server follows";
  EXPECT_TRUE(felt(0.5 * kFineReach_m + farther_m, by_vessel)) << "at what it carries";
  EXPECT_TRUE(said("move them in both", false));
}

TEST_F(Surgery, AProtectedZoneIsFeltByItsName) {
  constexpr double kNerveAway_m = -0.012, kInZone_m = 0.0003;  // 1.5 mm over the nerve in its middle
  y_m_ = kNerveAway_m;
  EXPECT_TRUE(felt(kInZone_m, [](const msg::Percept& percept) {
    return percept.object() == 5 && percept.mu() == 32.0 && percept.link() == kArmJoints;
  }));
}

}  // namespace
}  // namespace phantom::end_to_end

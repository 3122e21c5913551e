// The system with the arm's drives on CAN buses: simulated_drive processes in place of hardware.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <csignal>
#include <cstring>
#include <iostream>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>

#include "common/core/joints.hpp"
#include "common/dds/endpoints/endpoint.hpp"
#include "common/dds/endpoints/stamp.hpp"
#include "tests/end_to_end/running_system.hpp"
#include "tests/support/child_process.hpp"

namespace phantom::end_to_end {
namespace {

using testing::HasSubstr;

class CanDrives : public testing::Test {
 protected:
  void run(double seconds, const std::string& without = "", const std::string& topology = "can_drives") {
    system_.emplace(seconds, topology, without);
    participant_.emplace("can_drives_test", system_->network());
    statuses_.emplace(*participant_, dds::kComponentStatus,
                      [this](const msg::ComponentStatus& s, const dds::SampleInfo&) {
                        const std::lock_guard lock(mutex_);
                        if (s.component_name() == "slave_io") status_ = s;
                      });
    masters_.emplace(*participant_, dds::kMasterState,
                     [this](const msg::MasterState& m, const dds::SampleInfo&) {
                       const std::lock_guard lock(mutex_);
                       master_ = m;
                       if (m.state() != msg::LinkState::LINK_COUPLED) return;
                       for (std::size_t j = 0; j < 7; ++j) {
                         const double power_W = m.percept_torque_Nm()[j] * m.velocity_rad_s()[j];
                         greatest_drag_power_W_ = std::max(greatest_drag_power_W_, power_W);
                       }
                     });
    slaves_.emplace(*participant_, dds::kSlaveState,
                    [this](const msg::SlaveState& s, const dds::SampleInfo&) { on_slave(s); });
  }
  void on_slave(const msg::SlaveState& s) {
    const std::lock_guard lock(mutex_);
    // Until it couples the arm stands; its first states may be from before the drives answered.
    if (before_ && s.stamp().session() != before_->stamp().session() &&
        s.state() != msg::LinkState::LINK_COUPLED) {
      double away_rad = 0.0;
      for (std::size_t j = 0; j < 7; ++j)
        away_rad = std::max(away_rad, std::abs(s.position_rad()[j] - before_->position_rad()[j]));
      ran_on_rad_ = std::min(ran_on_rad_, away_rad);
    }
    for (std::size_t j = 0; slave_ && j < 7; ++j) {
      greatest_step_ = std::max(greatest_step_, std::abs(s.position_rad()[j] - slave_->position_rad()[j]));
      fastest_ = std::max(fastest_, std::abs(s.velocity_rad_s()[j]));
    }
    slave_ = s;
  }
  bool slave_reaches(msg::LinkState state) {
    return eventually(
        [&] {
          const std::lock_guard lock(mutex_);
          return slave_ && slave_->state() == state;
        },
        60.0);
  }
  bool told(msg::ComponentState state, const std::string& words) {
    return eventually([&] {
      const std::lock_guard lock(mutex_);
      return status_ && status_->state() == state &&
             status_->message().to_string().find(words) != std::string::npos;
    });
  }
  void TearDown() override {
    end_drives();
    if (!HasFailure()) return;
    const std::lock_guard lock(mutex_);
    std::cerr << system_->output() << read_text(system_->report() / "logs/slave_io.log")
              << (status_ ? status_->message().to_string() : "no status") << '\n';
  }

  // The drives of bus b as somebody else's process, as real ones are: they may die without the session.
  void start_drives() {
    const std::vector<std::string> words{PHANTOM_BIN_DIR "/simulated_drive", "--config",
                                         (system_->folder() / "hot_cell_drives_b.yaml").string()};
    drives_.emplace(words, system_->folder() / "drives_b.log");
  }
  void end_drives() { drives_.reset(); }
  void reset() {
    if (!commands_) commands_.emplace(*participant_, dds::kOperatorCommand);
    if (!stamper_) stamper_.emplace(*participant_);
    ASSERT_TRUE(eventually([&] { return commands_->matched() >= 2; })) << "master_io and slave_io listen";
    msg::OperatorCommand command;
    command.issuer("can_drives_test");
    command.kind(msg::CommandKind::COMMAND_RESET);
    {
      const std::lock_guard lock(mutex_);
      if (master_) command.master_stop(master_->stop());
      if (slave_) command.slave_stop(slave_->stop());
    }
    command.stamp(stamper_->next());
    commands_->write(command);
  }

  std::mutex mutex_;
  std::optional<msg::ComponentStatus> status_;
  std::optional<msg::SlaveState> slave_;
  std::optional<msg::SlaveState> before_;  // the last of a process that was ended
  static constexpr double kNotKnown_rad = 1e9;
  double ran_on_rad_ = kNotKnown_rad;  // from there to where the next one finds the arm, of any joint
  std::optional<msg::MasterState> master_;
  double greatest_drag_power_W_ = -1.0;         // while coupled, of any joint
  double greatest_step_ = 0.0, fastest_ = 0.0;  // between two samples; of any joint
  std::optional<RunningSystem> system_;
  std::optional<test::Process> drives_;
  std::optional<dds::Participant> participant_;
  std::optional<dds::Reader<msg::ComponentStatus>> statuses_;
  std::optional<dds::Reader<msg::SlaveState>> slaves_;
  std::optional<dds::Reader<msg::MasterState>> masters_;
  std::optional<dds::Writer<msg::OperatorCommand>> commands_;
  std::optional<dds::Stamper> stamper_;
};

TEST_F(CanDrives, ASessionRunsToItsEndAndTheReachesFollow) {
  run(15.0);
  ASSERT_TRUE(slave_reaches(msg::LinkState::LINK_COUPLED));
  {
    const std::lock_guard lock(mutex_);
    EXPECT_EQ(slave_->clearance_m(), -1.0);
    EXPECT_EQ(slave_->contact_force_N(), -1.0);
  }
  EXPECT_EQ(system_->wait(), 0) << system_->output();
  const auto summary = nlohmann::json::parse(read_text(system_->report() / "summary.json"));
  EXPECT_GE(summary.at("reaches").size(), 1U);
  EXPECT_EQ(summary.at("components").at("drives_a").at("exit"), 0);
  EXPECT_EQ(summary.at("components").at("drives_b").at("exit"), 0);
  EXPECT_GT(fastest_, 0.05) << "the arm moved";
}

// Tries slave_io: bus down
// Tries slave_io: buses not there yet
// Tries simulated_drive: the process that serves the bus
TEST_F(CanDrives, DrivesThatDieStopTheArmWithoutAJumpAndAResetBringsThemBack) {
  run(0.0, "drives_b");
  EXPECT_TRUE(told(msg::ComponentState::COMPONENT_STARTING, "no process serves this bus"));
  start_drives();
  ASSERT_TRUE(slave_reaches(msg::LinkState::LINK_COUPLED));
  core::JointArray before{};
  {
    const std::lock_guard lock(mutex_);
    greatest_step_ = 0.0;
    before = slave_->position_rad();
  }
  end_drives();
  ASSERT_TRUE(slave_reaches(msg::LinkState::LINK_STOPPED));
  {
    const std::lock_guard lock(mutex_);
    EXPECT_EQ(slave_->stop_cause(), msg::StopCause::STOP_DRIVE_FAULT);
  }
  EXPECT_TRUE(told(msg::ComponentState::COMPONENT_FAULT, "the drives hold until a reset"));
  {
    const std::lock_guard lock(mutex_);
    for (std::size_t j = 0; j < 7; ++j) EXPECT_NEAR(slave_->position_rad()[j], before[j], 0.1) << j;
    EXPECT_LT(greatest_step_, 0.1);
  }
  start_drives();  // at the home pose again, as if the joints had been moved by hand: near enough to align
  ASSERT_TRUE(eventually([&] {
    reset();
    const std::lock_guard lock(mutex_);
    return slave_->state() != msg::LinkState::LINK_STOPPED;
  })) << "the drives are there again";
  system_->stop();
  EXPECT_EQ(system_->wait(), 0) << system_->output();
}

TEST_F(CanDrives, TheSessionTellsThatItsDrivesDied) {
  run(0.0);
  ASSERT_TRUE(slave_reaches(msg::LinkState::LINK_COUPLED));
  const pid_t drives = system_->process("drives_a");
  ASSERT_GT(drives, 0);
  kill(drives, SIGSTOP);
  EXPECT_TRUE(slave_reaches(msg::LinkState::LINK_STOPPED));
  EXPECT_TRUE(told(msg::ComponentState::COMPONENT_FAULT, "the drives hold until a reset"));
  kill(drives, SIGKILL);
  EXPECT_EQ(system_->wait(), 1);
  EXPECT_THAT(system_->output(), HasSubstr("drives_a ended unexpectedly with code 137"));
}

// However slave_io is asked to end, it stops the drives first: how far a joint that moves runs on after its
// last state is measured by the next process. Tries slave_io: its terminal is closed
TEST_F(CanDrives, AJointStopsAsSoonByAHangUpOrAQuitAsByATermination) {
  constexpr double kMaxRunOn_rad = 0.06, kMoving_rad_s = 0.3;
  run(0.0, "slave_io");
  const std::vector<std::string> words{PHANTOM_BIN_DIR "/slave_io",
                                       "--deployment",
                                       (system_->folder() / "topology.yaml").string(),
                                       "--domain",
                                       std::to_string(system_->network().domain),
                                       "--state-dir",
                                       (system_->folder() / "state").string()};
  const auto speed_rad_s = [&] {
    const std::lock_guard lock(mutex_);
    double speed = 0.0;
    for (std::size_t j = 0; slave_ && j < 7; ++j)
      speed = std::max(speed, std::abs(slave_->velocity_rad_s()[j]));
    return speed;
  };
  const auto ran_on_rad = [&] {
    const std::lock_guard lock(mutex_);
    return ran_on_rad_;
  };
  auto slave = std::make_unique<test::Process>(words, system_->folder() / "slave.log");
  for (const int number : {SIGTERM, SIGHUP, SIGQUIT}) {
    ASSERT_TRUE(eventually([&] { return speed_rad_s() > kMoving_rad_s; }, 60.0)) << slave->output();
    EXPECT_EQ(slave->end(number), 0) << slave->output();
    {
      const std::lock_guard lock(mutex_);
      before_ = slave_;
      ran_on_rad_ = kNotKnown_rad;
    }
    // While no master speaks, the next process leaves the arm where it finds it, until it was seen.
    const pid_t master = system_->process("master_io");
    ASSERT_GT(master, 0);
    kill(master, SIGSTOP);
    slave = std::make_unique<test::Process>(words, system_->folder() / "slave.log");
    EXPECT_TRUE(eventually([&] { return ran_on_rad() <= kMaxRunOn_rad; }, 60.0))
        << strsignal(number) << ": ran on by " << ran_on_rad() << " rad\n"
        << slave->output();
    kill(master, SIGCONT);
    ASSERT_TRUE(eventually(
        [&] {
          const std::lock_guard lock(mutex_);
          return slave_->stamp().session() != before_->stamp().session() &&
                 slave_->state() == msg::LinkState::LINK_COUPLED;
        },
        60.0))
        << slave->output();
    std::cout << strsignal(number) << ": ran on by " << ran_on_rad() << " rad\n";
  }
  slave.reset();
  system_->stop();
  system_->wait();
}

// The other side: the master arm has the drives, a hand moves it, the simulated arm follows, and drag is
// felt.
// Tries slave_io: its drives in fault
TEST_F(CanDrives, AMasterArmWithDrivesMovesTheArmAndRendersTheDrag) {
  run(0.0, "", "can_master");
  ASSERT_TRUE(slave_reaches(msg::LinkState::LINK_COUPLED));
  core::JointArray before{};
  {
    const std::lock_guard lock(mutex_);
    before = slave_->position_rad();
  }
  EXPECT_TRUE(eventually(
      [&] {
        const std::lock_guard lock(mutex_);
        const double moved = std::abs(slave_->position_rad()[1] - before[1]);
        return moved > 0.15 && std::abs(slave_->position_rad()[1] - master_->position_rad()[1]) < 0.03;
      },
      60.0))
      << "the arm follows the hand";
  const pid_t drives = system_->process("master_drives_b");
  ASSERT_GT(drives, 0);
  kill(drives, SIGSTOP);
  EXPECT_TRUE(eventually([&] {
    const std::lock_guard lock(mutex_);
    return master_->state() == msg::LinkState::LINK_STOPPED &&
           master_->stop_cause() == msg::StopCause::STOP_DRIVE_FAULT;
  }));
  EXPECT_TRUE(slave_reaches(msg::LinkState::LINK_STOPPED)) << "a master in fault stops the arm";
  kill(drives, SIGCONT);
  EXPECT_TRUE(eventually(
      [&] {
        reset();
        const std::lock_guard lock(mutex_);
        return master_->state() == msg::LinkState::LINK_COUPLED &&
               slave_->state() == msg::LinkState::LINK_COUPLED;
      },
      60.0));
  {
    const std::lock_guard lock(mutex_);
    EXPECT_LE(greatest_drag_power_W_, 0.0) << "drag takes energy, always";
  }
  system_->stop();
  EXPECT_EQ(system_->wait(), 0) << system_->output();
}

}  // namespace
}  // namespace phantom::end_to_end

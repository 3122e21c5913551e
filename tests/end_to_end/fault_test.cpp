// What the system does when a part of it dies or freezes, seen from outside.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <cstring>
#include <filesystem>
#include <iostream>
#include <mutex>
#include <optional>

#include "common/dds/endpoints/endpoint.hpp"
#include "common/dds/endpoints/stamp.hpp"
#include "tests/end_to_end/running_system.hpp"

namespace phantom::end_to_end {
namespace {

// The running system with the topics that tell how it takes a fault.
class Fault : public testing::Test {
 protected:
  Fault()
      : participant_("fault_test", system_.network()),
        statuses_(participant_, dds::kComponentStatus,
                  [this](const msg::ComponentStatus& s, const dds::SampleInfo&) {
                    const std::lock_guard lock(mutex_);
                    pids_[s.component_name().to_string()] = static_cast<pid_t>(s.process_id());
                  }),
        masters_(participant_, dds::kMasterState,
                 [this](const msg::MasterState& m, const dds::SampleInfo&) {
                   const std::lock_guard lock(mutex_);
                   master_ = m;
                 }),
        slaves_(participant_, dds::kSlaveState,
                [this](const msg::SlaveState& state, const dds::SampleInfo&) {
                  const std::lock_guard lock(mutex_);
                  slave_ = state;
                }),
        fields_(participant_, dds::kDragField, [this](const msg::DragField& f, const dds::SampleInfo&) {
          const std::lock_guard lock(mutex_);
          field_ = f;
        }) {}

  bool coupled() {
    return eventually([this] {
      const std::lock_guard lock(mutex_);
      return master_ && master_->state() == msg::LinkState::LINK_COUPLED && field_ && field_->valid() &&
             pids_.contains("slave_io");
    });
  }
  pid_t pid(const std::string& component) {
    const std::lock_guard lock(mutex_);
    return pids_.at(component);
  }
  bool master_reaches(msg::LinkState state, double limit_s = 30.0) {
    return eventually(
        [this, state] {
          const std::lock_guard lock(mutex_);
          return master_->state() == state;
        },
        limit_s);
  }
  bool slave_reaches(msg::LinkState state) {
    return eventually([this, state] {
      const std::lock_guard lock(mutex_);
      return slave_->state() == state;
    });
  }
  msg::OperatorCommand reset_of_now() {
    const std::lock_guard lock(mutex_);
    msg::OperatorCommand reset;
    reset.kind(msg::CommandKind::COMMAND_RESET);
    reset.master_stop(master_->stop());
    reset.slave_stop(slave_->stop());
    reset.issuer("fault_test");
    return reset;
  }
  // As an operator does: names the stops that are shown, and again if another one has come meanwhile (the
  // side that learns from the other's word before it hears the command has two, one after the other).
  bool reset_until_coupled(dds::Writer<msg::OperatorCommand>& commands, dds::Stamper& stamper) {
    for (int attempt = 0; attempt < 5; ++attempt) {
      msg::OperatorCommand reset = reset_of_now();
      reset.stamp(stamper.next());
      commands.write(reset);
      if (master_reaches(msg::LinkState::LINK_COUPLED, 6.0)) return true;
    }
    return false;
  }

  // However it is asked to end: a terminal that is closed, a service that is stopped.
  void expect_an_end_in_order_by(int signal) {
    system_.stop(signal);
    EXPECT_EQ(system_.wait(), 0) << strsignal(signal);
    EXPECT_TRUE(std::filesystem::exists(system_.report() / "index.html")) << strsignal(signal);
    EXPECT_THAT(read_text(system_.report() / "summary.json"), testing::HasSubstr("\"exit\": 0"));
  }

  // A failure is told with what the system said and the states it was left in.
  void TearDown() override {
    if (!HasFailure()) return;
    const std::lock_guard lock(mutex_);
    std::cerr << system_.output() << "master state " << (master_ ? static_cast<int>(master_->state()) : -1)
              << ", slave state " << (slave_ ? static_cast<int>(slave_->state()) : -1)
              << ", drag field valid " << (field_ ? field_->valid() : -1) << '\n';
  }

  RunningSystem system_{0.0};
  std::mutex mutex_;
  std::map<std::string, pid_t> pids_;
  std::optional<msg::MasterState> master_;
  std::optional<msg::SlaveState> slave_;
  std::optional<msg::DragField> field_;
  dds::Participant participant_;
  dds::Reader<msg::ComponentStatus> statuses_;
  dds::Reader<msg::MasterState> masters_;
  dds::Reader<msg::SlaveState> slaves_;
  dds::Reader<msg::DragField> fields_;
};

// Tries phantom_session: a component ends unasked
TEST_F(Fault, AComponentThatDiesIsToldAndEndsTheSessionWithAFailureCode) {
  ASSERT_TRUE(coupled());
  kill(pid("phantom_sensing"), SIGKILL);
  EXPECT_EQ(system_.wait(), 1);
  EXPECT_THAT(system_.output(), testing::HasSubstr("phantom_sensing ended unexpectedly with code 137"));
  EXPECT_THAT(read_text(system_.report() / "summary.json"), testing::HasSubstr("\"exit\": 137"));
}

// Tries master_io: frozen
TEST_F(Fault, AFrozenSlaveMakesTheMasterRampItsTorqueToZeroAndThePerceptInvalid) {
  ASSERT_TRUE(coupled());
  const pid_t slave = pid("slave_io");
  kill(slave, SIGSTOP);
  EXPECT_TRUE(master_reaches(msg::LinkState::LINK_DEGRADED));
  EXPECT_TRUE(eventually([this] {
    const std::lock_guard lock(mutex_);
    double torque_Nm = 0.0;
    for (const double t : master_->percept_torque_Nm()) torque_Nm += std::abs(t);
    for (const double t : master_->feedback_torque_Nm()) torque_Nm += std::abs(t);
    return torque_Nm == 0.0 && !field_->valid();
  }));
  kill(slave, SIGCONT);
  EXPECT_TRUE(master_reaches(msg::LinkState::LINK_COUPLED))
      << "it recovers by itself once the slave is back and aligned";
  expect_an_end_in_order_by(SIGHUP);
}

TEST_F(Fault, AnEmergencyStopTakesTheTorqueAndStaysUntilAResetThatNamesIt) {
  ASSERT_TRUE(coupled());
  dds::Writer<msg::OperatorCommand> commands(participant_, dds::kOperatorCommand);
  ASSERT_TRUE(eventually([&] { return commands.matched() >= 2; })) << "master_io and slave_io listen";
  dds::Stamper stamper(participant_);
  msg::OperatorCommand command;
  command.issuer("fault_test");
  command.kind(msg::CommandKind::COMMAND_EMERGENCY_STOP);
  command.stamp(stamper.next());
  commands.write(command);
  EXPECT_TRUE(master_reaches(msg::LinkState::LINK_STOPPED));
  EXPECT_TRUE(slave_reaches(msg::LinkState::LINK_STOPPED));
  EXPECT_TRUE(reset_until_coupled(commands, stamper));
  expect_an_end_in_order_by(SIGQUIT);
}

TEST_F(Fault, ASignalToEitherSideStopsBoth) {
  ASSERT_TRUE(coupled());
  dds::Writer<msg::OperatorCommand> commands(participant_, dds::kOperatorCommand);
  ASSERT_TRUE(eventually([&] { return commands.matched() >= 2; }));
  dds::Stamper stamper(participant_);
  for (const char* side : {"slave_io", "master_io"}) {
    kill(pid(side), SIGUSR1);
    EXPECT_TRUE(master_reaches(msg::LinkState::LINK_STOPPED)) << side;
    EXPECT_TRUE(slave_reaches(msg::LinkState::LINK_STOPPED)) << side;
    EXPECT_TRUE(reset_until_coupled(commands, stamper)) << side;
  }
  expect_an_end_in_order_by(SIGTERM);
}

}  // namespace
}  // namespace phantom::end_to_end

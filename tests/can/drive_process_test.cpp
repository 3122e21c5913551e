// The real executable on a userspace bus: killed, frozen, and with faults of its own; on the real clock, with
// times that a busy machine can keep.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <optional>
#include <sstream>
#include <thread>

#include "common/can/wrench_frames.hpp"
#include "common/core/errors.hpp"
#include "common/runtime/configuration/drives_check.hpp"
#include "common/simulation/user_bus_hub.hpp"
#include "tests/can/rig.hpp"
#include "tests/support/child_process.hpp"

namespace phantom {
namespace {

using can::DriveFault;
using can::DriveGroupState;

class DriveProcess : public testing::Test {
 protected:
  void SetUp() override {
    hub_ = simulation::UserBusHub::serve(address_, {.bit_rate = 1e6}).value();
    connect();
  }
  void connect() {
    auto config = test::group_config(can::DriveMode::kPosition, 2);
    config.timing = {.period_s = 0.01,
                     .heartbeat_s = 0.1,
                     .heartbeat_timeout_s = 1.0,
                     .most_missed = 40,
                     .sdo_timeout_s = 0.5,
                     .boot_timeout_s = 0.5,
                     .state_timeout_s = 5.0};
    std::vector<std::unique_ptr<can::CanBus>> ports;
    ports.push_back(can::open_bus(address_).value());
    group_ = std::make_unique<can::DriveGroup>(config, std::move(ports));
  }
  void TearDown() override { end(); }

  void start(std::vector<std::string> more = {}) {
    more.insert(more.begin(), {PHANTOM_SIMULATED_DRIVE, "--bus", drive_address_, "--nodes", "1,2"});
    process_.emplace(more, test::new_file("", ".log"));
  }
  void end() { process_.reset(); }
  bool reaches(DriveGroupState state, double most_s = 20.0) {
    const auto until = std::chrono::steady_clock::now() + std::chrono::duration<double>(most_s);
    while (std::chrono::steady_clock::now() < until) {
      if (group_->step(command_, core::monotonic_ns()).state == state) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return false;
  }
  bool recovers() {
    command_.reset = true;
    group_->step(command_, core::monotonic_ns());
    command_.reset = false;
    return reaches(DriveGroupState::kEnabled);
  }

  std::string address_ = std::string("user:drive-").append(std::to_string(getpid()));
  std::string drive_address_ = address_;
  std::unique_ptr<simulation::UserBusHub> hub_;
  std::unique_ptr<can::DriveGroup> group_;
  can::DriveCommand command_{.enable = true};
  std::optional<test::Process> process_;
};

/// What a drive that falls silent is found by. If it does so between its two PDOs of a SYNC, the second is
/// the one that has been missing for longer.
const auto kSilent = testing::AnyOf(DriveFault::kFeedbackMissing, DriveFault::kMeasurementMissing);

TEST_F(DriveProcess, FollowsAndIsFoundWhenKilledAndWhenItComesBack) {
  start();
  ASSERT_TRUE(reaches(DriveGroupState::kEnabled)) << group_->sentence();
  command_.position[0] = 0.2;
  for (int i = 0; i < 400 && std::abs(group_->report().position[0] - 0.2) > 1e-3; ++i)
    reaches(DriveGroupState::kFault, 0.01);
  EXPECT_NEAR(group_->report().position[0], 0.2, 1e-3);
  end();
  ASSERT_TRUE(reaches(DriveGroupState::kFault));
  EXPECT_THAT(group_->report().drives[0].fault, kSilent);
  start();
  EXPECT_TRUE(recovers()) << group_->sentence();
}

TEST_F(DriveProcess, AFrozenProcessIsFoundAndTakenBackAfterAReset) {
  start();
  ASSERT_TRUE(reaches(DriveGroupState::kEnabled)) << group_->sentence();
  process_->signal(SIGSTOP);
  ASSERT_TRUE(reaches(DriveGroupState::kFault));
  // Whichever drive's next message was due first is found first.
  const auto drives = group_->report().drives;
  EXPECT_TRUE(testing::Matches(kSilent)(drives[0].fault) || testing::Matches(kSilent)(drives[1].fault));
  process_->signal(SIGCONT);
  reaches(DriveGroupState::kEnabled,
          0.5);  // what had piled up goes over the bus; nothing follows without a reset
  EXPECT_EQ(group_->report().state, DriveGroupState::kFault);
  EXPECT_TRUE(recovers()) << group_->sentence();
}

TEST_F(DriveProcess, OurOwnBusOffIsLeftByAReset) {
  start();
  ASSERT_TRUE(reaches(DriveGroupState::kEnabled)) << group_->sentence();
  hub_->set_bus_off(getpid());
  ASSERT_TRUE(reaches(DriveGroupState::kFault));
  EXPECT_EQ(group_->report().drives[0].fault, DriveFault::kBusOff);
  EXPECT_TRUE(recovers()) << group_->sentence();
}

TEST_F(DriveProcess, AFaultOfItsOwnComesAsAskedFor) {
  start({"--fault", "trip@0:2"});
  ASSERT_TRUE(reaches(DriveGroupState::kFault));
  EXPECT_EQ(group_->report().drives[1].fault, DriveFault::kDriveFault);
  EXPECT_TRUE(recovers()) << group_->sentence();
}

// The sensor at the wrist, as whoever reads its frames gets them.
TEST_F(DriveProcess, AForceSensorSendsItsMeasurementsOnTheUserspaceBus) {
  const std::string sensor =
      "\nforce_torque_sensor: {node: 1, id: 416, count_N: 0.02, count_Nm: 0.001, axis: [0, 1, 0], "
      "touches_at_m: [0, 0, 0.5], normal: [1, 0, 0], weight_N: [0, 0, -10], weight_at_m: [0, 0.1, 0], "
      "noise_N: 0.2, offset_N: 3}\n";
  const auto file = test::new_file("bus: \"" + address_ + "\"\ndrives: [{node: 1}, {node: 2}]" + sensor);
  can::WrenchFrames frames;
  for (std::size_t c = 0; c < 6; ++c)
    frames.channels[c] = {
        .id = c < 3 ? 416U : 417U, .first = static_cast<int>(c % 3) * 2, .scale = c < 3 ? 0.02 : 0.001};
  frames.status = {{.id = 416, .byte = 6, .mask = 0x81, .good = 0x80}};
  can::WrenchAssembly assembly(frames);
  const auto port = can::open_bus(address_).value();
  start({"--config", file.string()});
  int whole = 0;
  std::array<double, 6> sum{};
  const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  can::Received received;
  while (whole < 200 && std::chrono::steady_clock::now() < until) {
    port->wait(core::kNsPerSecond / 10);
    while (port->receive(received)) {
      if (!received.is_frame() || !assembly.take(received.frame, received.time_ns)) continue;
      ++whole;
      EXPECT_TRUE(assembly.wrench().valid);
      for (std::size_t c = 0; c < 6; ++c) sum[c] += assembly.wrench().values[c];
    }
  }
  ASSERT_GE(whole, 200);
  const double expected[] = {3.0, 3.0, -7.0, -1.0, 0.0, 0.0};
  for (std::size_t c = 0; c < 6; ++c) EXPECT_NEAR(sum[c] / whole, expected[c], 0.1) << c;
}

// Tries simulated_drive: wrong arguments
TEST_F(DriveProcess, WrongArgumentsEndWithTwo) {
  start({"--fault", "explode@1"});
  EXPECT_EQ(process_->wait(), 2);
}

// The same over SocketCAN; interfaces as in the contract suite of the buses.
class DriveOnSocketCan : public DriveProcess, public testing::WithParamInterface<std::string> {
 protected:
  void SetUp() override {
    if (GetParam().empty())
      GTEST_SKIP() << "no CAN interface named; scripts/test_can_vm runs these cases on Debian's own kernel";
    const auto comma = GetParam().find(',');
    address_ = GetParam().substr(0, comma);
    drive_address_ = comma == std::string::npos ? address_ : GetParam().substr(comma + 1);
    connect();
  }
};

TEST_P(DriveOnSocketCan, FollowsAndIsFoundWhenFrozenAndWhenKilled) {
  start();
  ASSERT_TRUE(reaches(DriveGroupState::kEnabled)) << group_->sentence();
  command_.position[0] = 0.2;
  for (int i = 0; i < 400 && std::abs(group_->report().position[0] - 0.2) > 1e-3; ++i)
    reaches(DriveGroupState::kFault, 0.01);
  EXPECT_NEAR(group_->report().position[0], 0.2, 1e-3);
  process_->signal(SIGSTOP);
  ASSERT_TRUE(reaches(DriveGroupState::kFault));
  // Whichever drive's next message was due first is found first.
  const auto drives = group_->report().drives;
  EXPECT_TRUE(testing::Matches(kSilent)(drives[0].fault) || testing::Matches(kSilent)(drives[1].fault));
  process_->signal(SIGCONT);
  reaches(DriveGroupState::kEnabled, 0.5);
  ASSERT_TRUE(recovers()) << group_->sentence();
  end();
  ASSERT_TRUE(reaches(DriveGroupState::kFault));
  start();
  EXPECT_TRUE(recovers()) << group_->sentence();
}

// Tries slave_io: bus down
TEST_P(DriveOnSocketCan, AnInterfaceThatGoesDownIsNamedAndLeftByAReset) {
  start();
  ASSERT_TRUE(reaches(DriveGroupState::kEnabled)) << group_->sentence();
  const std::string down = "/sbin/ip link set " + address_ + " down";
  ASSERT_EQ(std::system(down.c_str()), 0);
  ASSERT_TRUE(reaches(DriveGroupState::kFault));
  EXPECT_EQ(group_->report().drives[0].fault, DriveFault::kBusDown);
  end();
  command_.reset = true;  // takes the interface up again
  group_->step(command_, core::monotonic_ns());
  command_.reset = false;
  start();
  EXPECT_TRUE(reaches(DriveGroupState::kEnabled)) << group_->sentence();
}

// Tries slave_io: is down
TEST_P(DriveOnSocketCan, AnInterfaceThatIsDownIsNamedByTheCheck) {
  const auto take = [this](const char* way) {
    return std::system(("/sbin/ip link set " + address_ + " " + way).c_str());
  };
  ASSERT_EQ(take("down"), 0);
  const runtime::DrivesConfig drives{.group = test::group_config(can::DriveMode::kPosition, 2),
                                     .addresses = {address_}};
  EXPECT_THAT([&] { runtime::check_drives(drives); },
              testing::ThrowsMessage<core::MissingError>(testing::HasSubstr(address_ + ": is down")));
  EXPECT_EQ(take("up"), 0);
}

std::vector<std::string> interfaces() {
  std::vector<std::string> pairs;
  const char* given = std::getenv("PHANTOM_CAN_INTERFACES");
  std::istringstream list(given == nullptr ? "" : given);
  for (std::string pair; std::getline(list, pair, ';');) pairs.push_back(pair);
  if (pairs.empty()) pairs.emplace_back();
  return pairs;
}

INSTANTIATE_TEST_SUITE_P(Interfaces, DriveOnSocketCan, testing::ValuesIn(interfaces()));

}  // namespace
}  // namespace phantom

// What --check of an arm finds on its buses: on a userspace bus, with the real simulated_drive.
#include "common/runtime/configuration/drives_check.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <optional>
#include <thread>

#include "common/core/clock.hpp"
#include "common/core/errors.hpp"
#include "common/simulation/user_bus_hub.hpp"
#include "tests/can/rig.hpp"
#include "tests/support/child_process.hpp"

namespace phantom {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::ThrowsMessage;

class DrivesCheck : public testing::Test {
 protected:
  runtime::DrivesConfig config(int axes, double timeout_s = 5.0) const {
    runtime::DrivesConfig config{.group = test::group_config(can::DriveMode::kPosition, axes),
                                 .addresses = {address_}};
    config.group.timing.sdo_timeout_s = timeout_s;
    return config;
  }
  void serve() { hub_ = simulation::UserBusHub::serve(address_, {.bit_rate = 1e6}).value(); }
  void start_drives(const std::string& nodes, std::size_t count) {
    process_.emplace(std::vector<std::string>{PHANTOM_SIMULATED_DRIVE, "--bus", address_, "--nodes", nodes},
                     test::new_file("", ".log"));
    while (hub_->node_count() < count) usleep(2'000);
  }

  std::string address_ = std::string("user:check-").append(std::to_string(getpid()));
  std::unique_ptr<simulation::UserBusHub> hub_;
  std::optional<test::Process> process_;
};

/// Another node on the bus, which a thread serves until the object goes.
class Node {
 public:
  template <class Serve>
  Node(const std::string& address, Serve serve)
      : bus_(can::open_bus(address).value()), thread_([this, serve] {
          while (!ended_) serve(*bus_);
        }) {}
  ~Node() {
    ended_ = true;
    thread_.join();
  }

 private:
  std::unique_ptr<can::CanBus> bus_;
  std::atomic<bool> ended_ = false;
  std::thread thread_;
};

TEST_F(DrivesCheck, NamesEveryDriveThatAnswers) {
  serve();
  start_drives("1,2", 2);
  const auto drives = config(2);
  const std::string found = runtime::check_drives(drives);
  for (const can::AxisConfig& axis : drives.group.axes)
    EXPECT_THAT(found, HasSubstr("\n  " + axis.name + ", node " + std::to_string(axis.node) + " on " +
                                 address_ + ": vendor 0x"));
}

// Tries slave_io: a drive does not answer
TEST_F(DrivesCheck, ADriveThatIsSilentIsNamed) {
  serve();
  start_drives("1", 1);
  EXPECT_THAT([&] { runtime::check_drives(config(2, 0.3)); },
              ThrowsMessage<core::MissingError>(
                  AllOf(HasSubstr("node 2 on " + address_), HasSubstr("no answer within 0.3 s"))));
}

// Tries slave_io: a node is no CiA 402 drive
TEST_F(DrivesCheck, WhatIsNoDriveIsRefused) {
  serve();
  const Node gateway(address_, [](can::CanBus& bus) {
    bus.wait(core::from_seconds(0.01));
    can::Received received;
    while (bus.receive(received)) {  // device type 401, an I/O module (CiA 301, expedited upload of 4 octets)
      if (received.frame.id == 0x601)
        bus.send({.id = 0x581, .length = 8, .data = {0x43, 0x00, 0x10, 0x00, 0x91, 0x01, 0x00, 0x00}});
    }
  });
  EXPECT_THAT([&] { runtime::check_drives(config(1)); },
              ThrowsMessage<core::ConfigError>(HasSubstr("it is no CiA 402 drive (device type 0x00000191)")));
}

TEST_F(DrivesCheck, ABusThatAMasterServesIsNotDisturbed) {
  serve();
  std::atomic<int> asked = 0;
  const Node master(address_, [&asked](can::CanBus& bus) {
    bus.send({.id = 0x080, .length = 0, .data = {}});
    bus.wait(core::from_seconds(0.01));
    can::Received received;
    while (bus.receive(received))
      if (received.is_frame() && (received.frame.id & 0x780) == can::kCobSdoRequest) ++asked;
  });
  EXPECT_THAT(runtime::check_drives(config(1)), HasSubstr("a master serves it; its drives were not asked"));
  EXPECT_EQ(asked, 0);
}

TEST_F(DrivesCheck, AUserspaceBusThatNobodyServesIsSaidToBeMissing) {
  EXPECT_THAT(runtime::check_drives(config(1)), HasSubstr(address_ + ": not there yet"));
}

// Tries slave_io: a CAN interface is missing
TEST_F(DrivesCheck, AnInterfaceThatIsNotThereIsMissing) {
  auto drives = config(1);
  drives.addresses = {"can97"};
  EXPECT_THAT([&] { runtime::check_drives(drives); }, ThrowsMessage<core::MissingError>(HasSubstr("can97")));
}

}  // namespace
}  // namespace phantom

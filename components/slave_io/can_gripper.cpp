#include "components/slave_io/can_gripper.hpp"

#include "components/slave_io/can_arm.hpp"

namespace phantom::slave_io {
namespace {

constexpr double kOutside_m = 0.005;  // so far beyond its range the fingers may be when power comes on

std::vector<std::unique_ptr<can::CanBus>> only(std::unique_ptr<can::CanBus> bus, int node) {
  const can::CanFilter from_it{.id = static_cast<std::uint32_t>(node), .mask = 0x7F};
  // A bus without filters passes everything: the drive's group looks at the node, too.
  static_cast<void>(bus->set_filters(std::span(&from_it, 1)));
  std::vector<std::unique_ptr<can::CanBus>> buses;
  buses.push_back(std::move(bus));
  return buses;
}

}  // namespace

CanGripper::CanGripper(const can::DriveGroupConfig& config, std::unique_ptr<can::CanBus> bus)
    : drive_(config, core::JointArray{kOutside_m}, only(std::move(bus), config.axes.at(0).node)) {}

teleop::GripperSense CanGripper::sense() noexcept {
  const can::ArmDrivesSense& drive = drive_.sense();
  homing_ = homing_of(drive);
  return {drive.known, drive.position[0], drive.velocity[0], -drive.torque[0], drive.follows, drive.fault};
}

void CanGripper::move(const GripperCommand& command, double, core::Nanoseconds now_ns) noexcept {
  can::DriveCommand drive{.enable = command.power,
                          .quick_stop = command.stop && homing_ == HomingRequest::State::kRuns,
                          .reset = command.reset,
                          .home = command.home};
  drive.position[0] = command.demand.width_m;
  drive.torque[0] = command.demand.force_N;
  drive_.step(drive, now_ns);
}

}  // namespace phantom::slave_io

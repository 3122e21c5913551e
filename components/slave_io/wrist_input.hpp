#pragma once

#include <memory>
#include <optional>
#include <string>

#include "common/can/wrench_frames.hpp"
#include "common/teleop/guards/wrist_sensor.hpp"
#include "components/slave_io/dds_adapter.hpp"
#include "components/slave_io/model.hpp"

namespace phantom::slave_io {

/// Reads the sensor at the wrist, from its topic or its CAN bus, in the servo's thread and without waiting,
/// and puts what it says into the servo's report: F_e comes from it alone, contact from it or the arm.
class WristInput {
 public:
  /// `model` and `inbox` must outlive it. `bus`: an open bus for the sensor alone, if its configuration names
  /// one; it then receives the sensor's frames only.
  WristInput(const ArmModel& model, const WristSensorConfig& config, Inbox& inbox,
             std::unique_ptr<can::CanBus> bus = nullptr);

  /// Takes what came since the last tick, `dt_s` ago. `report` has the arm's state. Real-time safe: yes;
  /// except in the cycle of a reset while a userspace bus is down, because it connects anew.
  void step(SlaveReport& report, double dt_s, core::Nanoseconds now_ns) noexcept;

  const can::CanBus* bus() const noexcept { return bus_.get(); }

 private:
  void read_topic() noexcept;
  void read_bus() noexcept;

  const ArmModel& model_;
  Inbox& inbox_;
  std::unique_ptr<can::CanBus> bus_;
  std::optional<can::WrenchAssembly> assembly_;
  teleop::WristSensor sensor_;
  ReceivedWrench received_;
  teleop::WristSample sample_;
  core::Nanoseconds received_ns_ = 0;
  robot::LinkPoses X_WL_;
};

/// Returns a sentence for the operator on why the sensor measures nothing, or what became of its tare; empty
/// if there is nothing to say. `hinders`: set if it measures nothing and somebody has to see to it.
std::string wrist_sentence(const teleop::WristForce& force, bool& hinders);

}  // namespace phantom::slave_io

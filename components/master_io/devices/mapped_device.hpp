#pragma once

#include <memory>

#include "common/teleop/coupling/joint_mapping.hpp"
#include "components/master_io/config_mapping.hpp"
#include "components/master_io/devices/device.hpp"

namespace phantom::master_io {

/// A device of fewer joints than the arm as master: each of its joints leads one of the arm's, and the
/// torques of these go back to it (teleop::JointMapping). To everyone else it is a master with the arm's
/// joints. Those that are not led stand still: where they are configured, or else where the arm stood when it
/// was heard last before coupling, so that it need not move them.
class MappedDevice final : public Device {
 public:
  /// `own`: the device in its own joints. `start_q`: of the arm's joints, until the arm is heard.
  MappedDevice(const MappingConfig& config, std::unique_ptr<Device> own, const core::JointArray& start_q);

  const DeviceSense& sense(core::Nanoseconds now_ns) noexcept override;
  void move(const DeviceDemand& demand, double dt_s, core::Nanoseconds now_ns) noexcept override;
  void end(core::Nanoseconds now_ns) noexcept override { own_->end(now_ns); }
  bool makes_up_periods() const noexcept override { return own_->makes_up_periods(); }
  core::ActuatorHealth health() override { return own_->health(); }
  const MappingFigures* mapping_figures() const noexcept override { return &figures_; }

 private:
  void hold(const core::JointArray* arm_q) noexcept;

  MappingConfig config_;
  teleop::JointMapping mapping_;
  std::unique_ptr<Device> own_;
  core::JointArray others_;  // positions of the arm's joints that are not led
  core::JointArray own_velocity_{};
  bool apart_ = false;  // the arm waited for the master in the last tick
  DeviceSense sense_;
  MappingFigures figures_;
};

}  // namespace phantom::master_io

#pragma once

#include <atomic>

#include "components/master_io/cartesian_lead.hpp"

namespace phantom::master_io {

/// A haptic device that another process serves by the topics haptic_device and haptic_device_wrench
/// (docs/haptic_device.md). Its handle leads the virtual replica as that of CartesianDevice does. While it is
/// in trouble (teleop::DeviceWatch), its motors count as such that do not follow: master and slave uncouple,
/// the wrench falls to zero at its bounded rate, and what comes back is aligned anew.
class HapticDevice final : public Device {
 public:
  /// `arm` and `inbox` must outlive the device; the servo thread is the reader of `inbox`.
  HapticDevice(const Config& config, const robot::SerialArm& arm, const core::JointArray& start_q,
               core::Snapshot<HapticSample>& inbox);

  const DeviceSense& sense(core::Nanoseconds now_ns) noexcept override;
  void move(const DeviceDemand& demand, double dt_s, core::Nanoseconds now_ns) noexcept override;
  void end(core::Nanoseconds) noexcept override {}  // a device without wrenches fades out by itself
  bool makes_up_periods() const noexcept override { return false; }
  core::ActuatorHealth health() override;
  const CartesianFigures* cartesian_figures() const noexcept override { return &lead_.figures(); }
  const messages::HapticDeviceWrench* wrench_to_send() const noexcept override { return &wrench_; }

 private:
  CartesianLead lead_;
  teleop::DeviceWatch watch_;
  core::Snapshot<HapticSample>& inbox_;
  HapticSample newest_;
  DeviceSense sense_;
  messages::HapticDeviceWrench wrench_;
  double period_s_;
  std::atomic<teleop::DeviceTrouble> trouble_{teleop::DeviceTrouble::kSilent};  // for health()
  std::atomic<double> longer_s_{0.0};
};

}  // namespace phantom::master_io

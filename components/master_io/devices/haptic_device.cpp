#include "components/master_io/devices/haptic_device.hpp"

#include <algorithm>

namespace phantom::master_io {

HapticDevice::HapticDevice(const Config& config, const robot::SerialArm& arm, const core::JointArray& start_q,
                           core::Snapshot<HapticSample>& inbox)
    : lead_(config.cartesian.value(), arm, start_q),
      watch_(config.cartesian->watch),
      inbox_(inbox),
      period_s_(config.period_s) {
  wrench_.time_to_live_s = wrench_.fade_s = config.cartesian->watch.staleness_s;
}

const DeviceSense& HapticDevice::sense(core::Nanoseconds now_ns) noexcept {
  inbox_.read(newest_);
  const teleop::DeviceVerdict& verdict = watch_.step({.received_ns = newest_.received_ns,
                                                      .measured_ns = newest_.stamp.monotonic_ns,
                                                      .answers_ns = newest_.answers_ns,
                                                      .session = newest_.stamp.session,
                                                      .handle = newest_.handle,
                                                      .ready = newest_.ready,
                                                      .clutch = newest_.clutch},
                                                     now_ns, period_s_);
  lead_.sense(verdict.hand, sense_);
  sense_.follows = verdict.trouble == teleop::DeviceTrouble::kNone;
  sense_.longer_s = verdict.longer_s;
  trouble_.store(verdict.trouble, std::memory_order_relaxed);
  longer_s_.store(verdict.longer_s, std::memory_order_relaxed);
  return sense_;
}

void HapticDevice::move(const DeviceDemand& demand, double dt_s, core::Nanoseconds now_ns) noexcept {
  DeviceDemand now = demand;
  if (!sense_.follows) now.motor_Nm = {};
  lead_.render(now, newest_.able.actuated_axes, dt_s);
  lead_.advance(now, dt_s);
  wrench_.stamp.monotonic_ns = now_ns;
  wrench_.device_echo = newest_.stamp;
  wrench_.valid = sense_.follows;
  wrench_.leads = demand.coupled && lead_.hand().authority() > 0.0;
  const robot::Spatial felt = sense_.follows ? lead_.wrench() : robot::Spatial::Zero();
  std::copy_n(felt.data(), 3, wrench_.force_N.begin());
  std::copy_n(felt.data() + 3, 3, wrench_.moment_N_m.begin());
}

core::ActuatorHealth HapticDevice::health() {
  const auto trouble = trouble_.load(std::memory_order_relaxed);
  const double longer_ms = 1e3 * longer_s_.load(std::memory_order_relaxed);
  return {.follows = trouble == teleop::DeviceTrouble::kNone,
          .message = sentence(trouble),
          .figures = {{"device_loop_longer", longer_ms, "ms"}}};
}

}  // namespace phantom::master_io

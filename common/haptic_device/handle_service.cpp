#include "common/haptic_device/handle_service.hpp"

#include <algorithm>
#include <chrono>
#include <utility>

namespace phantom::haptic_device {
namespace {

constexpr std::chrono::microseconds kHandlePeriod{2000};
constexpr double kMaxStep_s = 0.05;  // after a hold-up the handle does not leap

messages::HapticAbilities abilities_of(const teleop::FreeHandleParameters& handle) {
  return {.measured_axes = messages::kAllAxes,
          .actuated_axes = messages::kAllAxes,
          .max_force_N = 1000.0,  // it has no motors that tire
          .max_moment_N_m = 100.0,
          .mass_kg = handle.mass_kg,
          .inertia_kg_m2 = handle.inertia_kg_m2,
          .workspace_m = teleop::FreeHandle::kWay_m,
          .workspace_rad = 10.0,
          .period_s = 1e-6 * static_cast<double>(kHandlePeriod.count())};
}

}  // namespace

HandleService::HandleService(dds::Participant& participant, const teleop::FreeHandleParameters& handle,
                             Step step, OnRefusal on_refusal)
    : able_(abilities_of(handle)),
      step_(std::move(step)),
      on_refusal_(std::move(on_refusal)),
      client_(participant),
      thread_([this](const std::stop_token& stop) { run(stop); }) {}

void HandleService::run(const std::stop_token& stop) {
  auto due = std::chrono::steady_clock::now();
  core::Nanoseconds last_ns = core::monotonic_ns();
  while (!stop.stop_requested()) {
    due = std::max(due + kHandlePeriod, std::chrono::steady_clock::now());
    std::this_thread::sleep_until(due);
    const core::Nanoseconds now_ns = core::monotonic_ns();
    turn(std::min(core::seconds(now_ns - last_ns), kMaxStep_s), now_ns);
    last_ns = now_ns;
  }
}

void HandleService::turn(double dt_s, core::Nanoseconds now_ns) {
  const HapticClient::Felt felt = client_.receive();
  robot::Spatial wrench;
  wrench << Eigen::Vector3d(felt.force_N.data()), Eigen::Vector3d(felt.moment_N_m.data());
  const Handle handle = step_(felt, wrench, dt_s, now_ns);
  messages::HapticDevice state;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    state.handle.position_m[i] = handle.hand.pose.translation_m[row];
    state.handle.velocity_m_s[i] = handle.hand.twist[row];
    state.handle.angular_velocity_rad_s[i] = handle.hand.twist[row + 3];
  }
  state.ready = handle.hand.valid;
  state.clutch = handle.hand.clutch;
  state.grip_opening = handle.grip_opening;
  state.able = able_;
  const Eigen::Vector4d q = geometry::quaternion_xyzw(handle.hand.pose.rotation);
  if (const core::Status sent = client_.send(state, {q[0], q[1], q[2], q[3]}); !sent)
    on_refusal_(sent.message());
}

}  // namespace phantom::haptic_device

#include "common/haptic_device/haptic_client.hpp"

#include <algorithm>

#include "common/core/thread_config.hpp"

namespace phantom::haptic_device {

HapticClient::HapticClient(dds::Participant& participant)
    : participant_(participant),
      stamper_(participant),
      writer_(participant, dds::kHapticDevice),
      reader_(participant, dds::kHapticDeviceWrench, {}, inbox_),
      sender_([this](const std::stop_token& stop) { send_all(stop); }) {}

HapticClient::~HapticClient() {
  sender_.request_stop();
  wake_.raise();
}

void HapticClient::send_all(const std::stop_token& stop) {
  core::apply_thread_config(core::ThreadRole::kPublisher, participant_.servo_priority());
  messages::HapticDevice state;
  while (!stop.stop_requested()) {
    wake_.wait(0.1);
    if (!outbox_.read(state)) continue;
    msg::HapticDevice message = to_idl(state);
    msg::Stamp stamp = stamper_.next();
    stamp.monotonic_ns(state.stamp.monotonic_ns);  // when it was measured
    message.stamp(stamp);
    writer_.write(message);
  }
}

void HapticClient::look(core::Nanoseconds now_ns) {
  Wrench newest;
  if (!inbox_.read(newest)) return;
  if (is_for_us(newest)) {
    exerted_ = newest;
    fades_from_ns_ = 0;
  } else if (fades_from_ns_ == 0) {
    fades_from_ns_ = now_ns;
  }
  heard_ = newest;
}

/// A second device hears the wrench of the first, too: it is valid for whose state it answers.
bool HapticClient::is_for_us(const Wrench& wrench) const {
  return wrench.valid && wrench.device_echo.session == participant_.session();
}

/// Share of the last valid wrench that is left.
double HapticClient::share(core::Nanoseconds now_ns) const {
  if (exerted_.received_ns == 0) return 0.0;
  const double of_age = share_at_age(exerted_, core::seconds(now_ns - exerted_.received_ns));
  if (fades_from_ns_ == 0) return of_age;
  return std::min(of_age, std::max(0.0, 1.0 - core::seconds(now_ns - fades_from_ns_) / exerted_.fade_s));
}

HapticClient::Felt HapticClient::receive() {
  const core::Nanoseconds now_ns = core::monotonic_ns();
  look(now_ns);
  const double left = share(now_ns);
  Felt felt;
  for (std::size_t i = 0; i < 3; ++i) {
    felt.force_N[i] = left * exerted_.force_N[i];
    felt.moment_N_m[i] = left * exerted_.moment_N_m[i];
  }
  if (heard_.received_ns == 0) return felt;
  felt.age_s = core::seconds(now_ns - heard_.received_ns);
  felt.valid = is_for_us(heard_) && felt.age_s <= heard_.time_to_live_s;
  felt.leads = felt.valid && heard_.leads;
  const core::Nanoseconds measured_ns =
      core::answered_ns(heard_.device_echo, participant_.session(), heard_.received_ns);
  if (measured_ns != 0) felt.answer_s = core::seconds(heard_.received_ns - measured_ns);
  return felt;
}

core::Status HapticClient::send(messages::HapticDevice state, const std::array<double, 4>& orientation_xyzw) {
  state.stamp = {1, core::monotonic_ns(), 0};
  state.wrench_echo = heard_.stamp;
  // The quaternion is checked as the receiver does; a rotation matrix would hide that it is none.
  msg::HapticDevice message = to_idl(state);
  message.X_DH().qx(orientation_xyzw[0]);
  message.X_DH().qy(orientation_xyzw[1]);
  message.X_DH().qz(orientation_xyzw[2]);
  message.X_DH().qw(orientation_xyzw[3]);
  const auto checked = messages::from_idl(message);
  if (!checked) return checked.status();
  outbox_.write(*checked);
  wake_.raise();
  return core::Status::ok();
}

}  // namespace phantom::haptic_device

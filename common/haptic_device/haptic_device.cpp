#include <algorithm>
#include <cstring>
#include <exception>
#include <span>
#include <string>
#include <thread>

#include "common/core/snapshot.hpp"
#include "common/core/thread_place.hpp"
#include "common/haptic_device/phantom_haptic_device.h"
#include "common/messages/checked_reader.hpp"
#include "common/messages/haptic_device_codec.hpp"
#include "common/messages/publisher.hpp"
#include "common/runtime/deployment.hpp"
#include "common/runtime/wake_signal.hpp"

using namespace phantom;

namespace {

using Wrench = messages::Received<messages::HapticDeviceWrench>;

/// Returns the topology's network as the arguments say it. Throws ConfigError, MissingError.
core::NetworkOptions network_of(std::span<char* const> arguments) {
  runtime::ProcessOptions options;
  options.component = "haptic_device";
  options.deployment = runtime::share_path("deploy/topologies/single_host.yaml");
  for (std::size_t i = 0; i + 1 < arguments.size(); ++i) {
    const std::string name = arguments[i], value = arguments[i + 1];
    if (name == "--deployment") options.deployment = value;
    if (name == "--host") options.host = value;
    if (name != "--domain") continue;
    if (value.empty() || value.size() > 3 || value.find_first_not_of("0123456789") != std::string::npos)
      throw core::ConfigError("--domain " + value + ": allowed: 0 to 232");
    options.domain = std::stoi(value);
  }
  return core::in_haptic_path(runtime::load_deployment(options).network, core::kServoPriority);
}

messages::HapticDevice state_of(const phantom_haptic_state& from, const messages::HapticAbilities& able) {
  messages::HapticDevice state;
  std::copy_n(from.position_m, 3, state.handle.position_m.begin());
  std::copy_n(from.velocity_m_s, 3, state.handle.velocity_m_s.begin());
  std::copy_n(from.angular_velocity_rad_s, 3, state.handle.angular_velocity_rad_s.begin());
  state.ready = from.ready != 0;
  state.clutch = from.clutch != 0;
  state.buttons = from.buttons;
  state.grip_opening = from.grip_opening;
  state.able = able;
  return state;
}

}  // namespace

/// A sender thread stands between the caller and DDS, whose writers may block.
struct phantom_haptic_device {
  phantom_haptic_device(const core::NetworkOptions& network, const phantom_haptic_abilities& abilities)
      : able{abilities.measured_axes,  abilities.actuated_axes, abilities.max_force_N,
             abilities.max_moment_N_m, abilities.mass_kg,       abilities.inertia_kg_m2,
             abilities.workspace_m,    abilities.workspace_rad, abilities.period_s},
        participant("haptic_device", network),
        stamper(participant),
        writer(participant, dds::kHapticDevice),
        reader(participant, dds::kHapticDeviceWrench, {},
               [this](const messages::HapticDeviceWrench& wrench, core::Nanoseconds received_ns) {
                 inbox.write({wrench, received_ns});
               }) {
    sender = std::jthread([this](const std::stop_token& stop) { send_all(stop); });
  }

  void send_all(const std::stop_token& stop) {
    core::take_place(core::ThreadRole::kPublisher, participant.servo_priority());
    messages::HapticDevice state;
    while (!stop.stop_requested()) {
      wake.wait(0.1);
      if (!outbox.read(state)) continue;
      msg::HapticDevice message = to_idl(state);
      msg::Stamp stamp = stamper.next();
      stamp.monotonic_ns(state.stamp.monotonic_ns);  // when it was measured
      message.stamp(stamp);
      writer.write(message);
    }
  }

  void look(core::Nanoseconds now_ns) {
    Wrench newest;
    if (!inbox.read(newest)) return;
    if (is_for_us(newest)) {
      exerted = newest;
      fades_from_ns = 0;
    } else if (fades_from_ns == 0) {
      fades_from_ns = now_ns;
    }
    heard = newest;
  }
  /// A second device hears the wrench of the first, too: it is valid for whose state it answers.
  bool is_for_us(const Wrench& wrench) const {
    return wrench.valid && wrench.device_echo.session == participant.session();
  }
  /// Share of the last valid wrench that is left.
  double share(core::Nanoseconds now_ns) const {
    if (exerted.received_ns == 0) return 0.0;
    const double of_age = share_at_age(exerted, core::seconds(now_ns - exerted.received_ns));
    if (fades_from_ns == 0) return of_age;
    return std::min(of_age, std::max(0.0, 1.0 - core::seconds(now_ns - fades_from_ns) / exerted.fade_s));
  }

  messages::HapticAbilities able;
  core::Snapshot<Wrench> inbox;
  core::Snapshot<messages::HapticDevice> outbox;
  runtime::WakeSignal wake;
  Wrench exerted, heard;  // the newest valid one, and the newest
  core::Nanoseconds fades_from_ns = 0;
  std::string why;
  dds::Participant participant;
  dds::Stamper stamper;
  dds::Writer<msg::HapticDevice> writer;
  messages::CheckedReader<msg::HapticDeviceWrench> reader;
  std::jthread sender;
};

extern "C" {

phantom_haptic_device* phantom_haptic_device_open(int argc, char* const argv[],
                                                  const phantom_haptic_abilities* abilities, char* why,
                                                  size_t why_size) {
  std::string problem;
  try {
    return new phantom_haptic_device(network_of({argv, static_cast<std::size_t>(std::max(argc, 0))}),
                                     *abilities);
  } catch (const std::exception& error) {
    problem = error.what();
  }
  if (why != nullptr && why_size > 0) {
    problem.resize(std::min(problem.size(), why_size - 1));
    std::memcpy(why, problem.c_str(), problem.size() + 1);
  }
  return nullptr;
}

void phantom_haptic_device_receive(phantom_haptic_device* device, phantom_haptic_wrench* wrench) {
  const core::Nanoseconds now_ns = core::monotonic_ns();
  device->look(now_ns);
  const Wrench &exerted = device->exerted, &heard = device->heard;
  const double share = device->share(now_ns);
  for (std::size_t i = 0; i < 3; ++i) {
    wrench->force_N[i] = share * exerted.force_N[i];
    wrench->moment_N_m[i] = share * exerted.moment_N_m[i];
  }
  const bool any = heard.received_ns != 0;
  const double age_s = any ? core::seconds(now_ns - heard.received_ns) : -1.0;
  const core::Nanoseconds measured_ns =
      any ? core::answered_ns(heard.device_echo, device->participant.session(), heard.received_ns) : 0;
  const bool valid = any && device->is_for_us(heard) && age_s <= heard.time_to_live_s;
  wrench->valid = valid ? 1 : 0;
  wrench->leads = valid && heard.leads ? 1 : 0;
  wrench->age_s = age_s;
  wrench->answer_s = measured_ns != 0 ? core::seconds(heard.received_ns - measured_ns) : -1.0;
}

int phantom_haptic_device_send(phantom_haptic_device* device, const phantom_haptic_state* state) {
  messages::HapticDevice sample = state_of(*state, device->able);
  sample.stamp = {1, core::monotonic_ns(), 0};
  sample.wrench_echo = device->heard.stamp;
  // The quaternion is checked as the receiver does; a rotation matrix would hide that it is none.
  msg::HapticDevice message = to_idl(sample);
  message.X_DH().qx(state->orientation_xyzw[0]);
  message.X_DH().qy(state->orientation_xyzw[1]);
  message.X_DH().qz(state->orientation_xyzw[2]);
  message.X_DH().qw(state->orientation_xyzw[3]);
  const auto checked = messages::from_idl(message);
  device->why = checked ? std::string() : checked.status().message();
  if (!checked) return 1;
  device->outbox.write(*checked);
  device->wake.raise();
  return 0;
}

const char* phantom_haptic_device_why(const phantom_haptic_device* device) { return device->why.c_str(); }

void phantom_haptic_device_close(phantom_haptic_device* device) {
  if (device == nullptr) return;
  device->sender.request_stop();
  device->wake.raise();
  delete device;
}

}  // extern "C"

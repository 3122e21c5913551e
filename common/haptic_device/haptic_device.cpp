#include <algorithm>
#include <cstring>
#include <exception>
#include <span>
#include <string>

#include "common/core/thread_config.hpp"
#include "common/haptic_device/haptic_client.hpp"
#include "common/haptic_device/phantom_haptic_device.h"
#include "common/runtime/configuration/deployment.hpp"

using namespace phantom;

namespace {

/// Returns the topology's network as the arguments say it. Throws ConfigError, MissingError.
core::NetworkOptions network_of(std::span<char* const> arguments) {
  runtime::ProcessOptions options;
  options.component = "haptic_device";
  options.deployment = runtime::share_path("deploy/topologies/single_host.yaml");
  for (std::size_t i = 0; i + 1 < arguments.size(); ++i) {
    const std::string name = arguments[i], value = arguments[i + 1];
    if (name == "--deployment" || name == "--topology") options.deployment = value;
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

struct phantom_haptic_device {
  phantom_haptic_device(const core::NetworkOptions& network, const phantom_haptic_abilities& abilities)
      : able{abilities.measured_axes,  abilities.actuated_axes, abilities.max_force_N,
             abilities.max_moment_N_m, abilities.mass_kg,       abilities.inertia_kg_m2,
             abilities.workspace_m,    abilities.workspace_rad, abilities.period_s},
        participant("haptic_device", network),
        client(participant) {}

  messages::HapticAbilities able;
  std::string why;
  dds::Participant participant;
  haptic_device::HapticClient client;
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
  const auto felt = device->client.receive();
  std::copy_n(felt.force_N.begin(), 3, wrench->force_N);
  std::copy_n(felt.moment_N_m.begin(), 3, wrench->moment_N_m);
  wrench->valid = felt.valid ? 1 : 0;
  wrench->leads = felt.leads ? 1 : 0;
  wrench->age_s = felt.age_s;
  wrench->answer_s = felt.answer_s;
}

int phantom_haptic_device_send(phantom_haptic_device* device, const phantom_haptic_state* state) {
  const double* q = state->orientation_xyzw;
  const core::Status sent = device->client.send(state_of(*state, device->able), {q[0], q[1], q[2], q[3]});
  device->why = sent ? std::string() : sent.message();
  return sent ? 0 : 1;
}

const char* phantom_haptic_device_why(const phantom_haptic_device* device) { return device->why.c_str(); }

void phantom_haptic_device_close(phantom_haptic_device* device) { delete device; }

}  // extern "C"

#include "components/slave_io/simulated_arm.hpp"

#include "common/simulation/contact_points.hpp"

namespace phantom::slave_io {
namespace {

std::vector<simulation::ContactPoint> points_of(const ArmModel& model, const ContactConfig& config) {
  auto points = simulation::contact_points(model.arm, model.skin, config.point_pitch_m, config.max_points);
  for (const robot::FingerPoint& point : model.fingers)
    points.push_back({point.link, point.open_m, point.closing_m});
  return points;
}

simulation::Handling handling_of(const Config& config, std::vector<simulation::LooseObject> loose) {
  simulation::Handling handling;
  handling.loose = std::move(loose);
  if (!config.gripper) return handling;
  handling.gripper = config.gripper->plant;
  handling.pad_friction = config.gripper->pad_friction;
  return handling;
}

}  // namespace

SimulatedArm::SimulatedArm(const ArmModel& model, const Config& config, const simulation::ContactWorld& world,
                           std::vector<simulation::LooseObject> loose,
                           std::unique_ptr<simulation::Yielding> yielding)
    : force_sensor_(config.force_sensor),
      plant_(model.arm, config.plant, points_of(model, config.contact), world, model.home,
             model.tip_in_last_link_m, handling_of(config, std::move(loose)), std::move(yielding),
             &model.buoyancy) {}

const ArmSense& SimulatedArm::sense() noexcept {
  sense_.position = plant_.position();
  sense_.velocity = plant_.velocity();
  sense_.gravity_Nm = plant_.gravity_Nm();
  return sense_;
}

void SimulatedArm::move(const ArmDemand& demand, double dt_s, core::Nanoseconds) noexcept {
  plant_.step(demand.outputs.torque.drive_Nm, dt_s);
  contacts_.step(plant_.contact(), plant_.tool_speed_m_s(), dt_s);
  clearance_m_.store(plant_.contact().clearance_m, std::memory_order_relaxed);
}

void SimulatedArm::fill(messages::SlaveState& state) const noexcept {
  state.position = plant_.position();
  state.velocity = plant_.velocity();
  const simulation::ContactReport& touch = plant_.contact();
  state.force_measured = force_sensor_;
  if (force_sensor_) state.external_torque_Nm = touch.joint_torque_Nm;
  state.contact = touch.contact;
  state.contact_force_N = touch.force_N;
  state.contact_object = touch.object;
  state.contact_point_m = {touch.point_W_m.x(), touch.point_W_m.y(), touch.point_W_m.z()};
  state.clearance_m = touch.clearance_m;
  state.tool_speed_m_s = plant_.tool_speed_m_s();
}

core::ActuatorHealth SimulatedArm::health() {
  return {false, true, "", {{"clearance", clearance_m_.load(std::memory_order_relaxed), "m"}}};
}

}  // namespace phantom::slave_io

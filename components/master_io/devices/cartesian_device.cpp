#include "components/master_io/devices/cartesian_device.hpp"

#include <algorithm>

namespace phantom::master_io {
namespace {

using robot::Spatial;

Spatial turned(const Eigen::Matrix3d& R, const Spatial& v) noexcept {
  Spatial result;
  result << R * v.head<3>(), R * v.tail<3>();
  return result;
}

core::JointArray array_of(const Spatial& v) noexcept {
  core::JointArray values{};
  std::copy_n(v.data(), kCartesianAxes, values.begin());
  return values;
}

}  // namespace

CartesianDevice::CartesianDevice(const Config& config, const robot::SerialArm& arm,
                                 const core::JointArray& start_q)
    : parameters_(config.cartesian.value()),
      R_home_(tool_pose_at(arm, start_q).rotation),
      lead_(parameters_, arm, start_q),
      plant_(parameters_.handle),
      person_(parameters_.indexing),
      pushed_(is_pushed(parameters_.input)),
      clutch_out_(pushed_) {}  // the simulated person begins with it in

const DeviceSense& CartesianDevice::sense(core::Nanoseconds) noexcept {
  lead_.sense({.pose = plant_.pose(), .twist = plant_.twist(), .clutch = !clutch_out_, .valid = true},
              sense_);
  sense_.hand_position = tool_coordinates(parameters_, R_home_, lead_.hand().tool_pose());
  sense_.hand_velocity =
      array_of(pushed_ ? plant_.true_twist() : turned(lead_.hand().rotation(), plant_.true_twist()));
  sense_.hand_waits = clutch_out_ || lead_.hand().authority() < 1.0;
  return sense_;
}

void CartesianDevice::move(const DeviceDemand& demand, double dt_s, core::Nanoseconds) noexcept {
  lead_.render(demand, messages::kAllAxes, dt_s);
  Spatial task;
  std::copy_n(demand.hand_Nm.begin(), kCartesianAxes, task.data());
  const Eigen::Matrix3d R_DW = lead_.hand().rotation().transpose();
  const Spatial push = pushed_ ? task : person_.step(plant_.pose(), plant_.true_twist(), turned(R_DW, task));
  clutch_out_ = pushed_ ? demand.clutch_out : !person_.clutch();
  lead_.advance(demand, dt_s);
  plant_.step(push, lead_.wrench(), dt_s);
}

}  // namespace phantom::master_io

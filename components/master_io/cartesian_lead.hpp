#pragma once

#include <optional>

#include "common/teleop/coupling/cartesian_hand.hpp"
#include "common/teleop/rendering/wrench_slew.hpp"
#include "components/master_io/config_cartesian.hpp"
#include "components/master_io/devices/device.hpp"

namespace phantom::master_io {

/// Returns `wrench` on a device whose motors act along and about `axes` alone (bits as HapticAbilities).
/// Where what is left would give a hand that moves with `twist` more power than the whole does, it is
/// smaller. Real-time safe: yes.
robot::Spatial actuated(const robot::Spatial& wrench, std::uint32_t axes,
                        const robot::Spatial& twist) noexcept;

/// What every Cartesian device does with the hand: it leads the virtual replica of the joints
/// (teleop::CartesianHand), gets their torques as a wrench within caps and slew, and notes how it went.
/// Real-time safe: yes.
class CartesianLead {
 public:
  /// `arm` must outlive the object.
  CartesianLead(const CartesianConfig& config, const robot::SerialArm& arm, const core::JointArray& start_q);

  /// Takes the handle's state of this tick, and writes the replica's position and velocity.
  void sense(const teleop::HandState& handle, DeviceSense& sense) noexcept;
  /// Renders the demand's torques on a device that can act along and about `axes`.
  void render(const DeviceDemand& demand, std::uint32_t axes, double dt_s) noexcept;
  /// Moves on to the next tick. After render().
  void advance(const DeviceDemand& demand, double dt_s) noexcept;

  const teleop::CartesianHand& hand() const noexcept { return hand_; }
  const teleop::HandState& handle() const noexcept { return handle_; }
  /// Wrench on the hand, in the device's axes, of the last tick.
  const robot::Spatial& wrench() const noexcept { return slew_.wrench(); }
  const CartesianFigures& figures() const noexcept { return figures_; }

 private:
  void note(const robot::Spatial& before, const DeviceDemand& demand, double dt_s) noexcept;

  std::size_t joint_count_;
  teleop::CartesianHand hand_;
  teleop::WrenchSlew slew_;
  teleop::HandState handle_;
  double rendered_share_ = 1.0;          // of the joints' power, in the last tick
  std::optional<Eigen::Matrix3d> R_WV_;  // of the view, as last heard
  CartesianFigures figures_;
};

}  // namespace phantom::master_io

#pragma once

#include "common/geometry/pose.hpp"
#include "common/robot/kinematics/jacobian.hpp"

namespace phantom::teleop {

/// Of a handle that no device has, and of who pushes it.
struct FreeHandleParameters {
  double mass_kg = 1.0, inertia_kg_m2 = 0.02;
  /// Force per speed, and moment per rate of turn, by which what the handle lacks of a wanted speed pushes
  /// it.
  double push_N_s_per_m = 60.0, push_N_m_s_per_rad = 1.0;
};

/// A handle that no device has: a body in free space, for those who lead an arm without one. Who leads pushes
/// it as a hand would, with a force in proportion to what its speed lacks, so that drag and feedback slow it
/// down. Where it stands is always where its speed has brought it. Its way is bounded: at its end it is spent
/// until it is back in the middle. Real-time safe: yes.
class FreeHandle {
 public:
  static constexpr double kWay_m = 9.0;    ///< half of its way along each axis
  static constexpr double kRests_s = 2.5;  ///< longer than a clutch may take to fade out

  explicit FreeHandle(const FreeHandleParameters& parameters) : parameters_(parameters) {}

  /// Moves on by `dt_s`, led at the speed `wanted` (m/s, rad/s), under `wrench` (N, N·m, at H's origin),
  /// which is left out if it is not finite; both in D, the handle's base.
  void lead(const robot::Spatial& wanted, const robot::Spatial& wrench, double dt_s) noexcept;
  /// Moves on by `dt_s` while nobody leads it. It stands still until no clutch can be fading any more, and
  /// then goes back to the middle of its way: what moves as a clutch fades moves the arm.
  void rest(double dt_s) noexcept;

  const geometry::Pose& pose() const noexcept { return X_DH_; }  ///< D ← H
  /// m/s, rad/s, of H in D.
  const robot::Spatial& twist() const noexcept { return twist_; }
  /// Returns whether it has come to the end of its way, and not back to the middle since.
  bool spent() const noexcept { return spent_; }

 private:
  void pursue(const robot::Spatial& wanted, double dt_s) noexcept;

  FreeHandleParameters parameters_;
  geometry::Pose X_DH_;
  robot::Spatial twist_ = robot::Spatial::Zero();
  double rested_s_ = 0.0;
  bool spent_ = false;
};

/// Shortens a vector to `largest`, if it is longer. Real-time safe: yes.
void shorten(Eigen::Ref<Eigen::Vector3d> v, double largest) noexcept;

}  // namespace phantom::teleop

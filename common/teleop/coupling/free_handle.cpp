#include "common/teleop/coupling/free_handle.hpp"

#include <cmath>

namespace phantom::teleop {
namespace {

constexpr double kReturn_per_s = 2.0;                        // to the middle of the way
constexpr double kFastest_m_s = 1.0, kFastest_rad_s = 10.0;  // whatever pushes
constexpr double kMiddle_m = 0.01;

}  // namespace

void shorten(Eigen::Ref<Eigen::Vector3d> v, double largest) noexcept {
  const double length = v.norm();
  if (length > largest) v *= largest / length;
}

void FreeHandle::lead(const robot::Spatial& wanted, const robot::Spatial& wrench, double dt_s) noexcept {
  rested_s_ = 0.0;
  robot::Spatial slowed = wanted;
  if (wrench.allFinite()) {
    slowed.head<3>() += wrench.head<3>() / parameters_.push_N_s_per_m;
    slowed.tail<3>() += wrench.tail<3>() / parameters_.push_N_m_s_per_rad;
  }
  pursue(slowed, dt_s);
  if (X_DH_.translation_m.cwiseAbs().maxCoeff() > kWay_m) spent_ = true;
}

void FreeHandle::rest(double dt_s) noexcept {
  rested_s_ += dt_s;
  robot::Spatial wanted = robot::Spatial::Zero();
  if (rested_s_ > kRests_s) {
    wanted.head<3>() = -kReturn_per_s * X_DH_.translation_m;
    shorten(wanted.head<3>(), kFastest_m_s);
  }
  pursue(wanted, dt_s);
  if (X_DH_.translation_m.norm() < kMiddle_m) spent_ = false;
}

// m·dv/dt = push·(wanted − v), exactly over the step.
void FreeHandle::pursue(const robot::Spatial& wanted, double dt_s) noexcept {
  const double moved = -std::expm1(-dt_s * parameters_.push_N_s_per_m / parameters_.mass_kg);
  const double turned = -std::expm1(-dt_s * parameters_.push_N_m_s_per_rad / parameters_.inertia_kg_m2);
  twist_.head<3>() += moved * (wanted.head<3>() - twist_.head<3>());
  twist_.tail<3>() += turned * (wanted.tail<3>() - twist_.tail<3>());
  shorten(twist_.head<3>(), kFastest_m_s);
  shorten(twist_.tail<3>(), kFastest_rad_s);
  X_DH_.translation_m += dt_s * twist_.head<3>();
  X_DH_.rotation = geometry::rotation_from_vector(dt_s * twist_.tail<3>()) * X_DH_.rotation;
  // Rounding must not make it something else than a rotation, however long it turns.
  X_DH_.rotation = geometry::rotation_from_quaternion(geometry::quaternion_xyzw(X_DH_.rotation));
}

}  // namespace phantom::teleop

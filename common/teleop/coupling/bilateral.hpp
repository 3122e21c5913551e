#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

#include "common/core/joints.hpp"

namespace phantom::teleop {

/// Bilateral laws of the thesis's Table 5.1. In all of them the slave follows with F_as = K_ps(X_m − X_s) +
/// K_vs·(Ẋ_m − Ẋ_s). They differ in F_am, the force of the slave that the hand feels.
enum class BilateralLaw : std::uint8_t {
  kPf,     ///< a: position forward, F_am = 0
  kSctfb,  ///< b: slave coordinating torque feedback, F_am = F_as / A
  kPfff,   ///< c: position forward, force feedback, F_am = F_e / A
  kPe,     ///< d: position exchange, F_am = (K_pm(X_m − X_s) + K_vm(Ẋ_m − Ẋ_s)) / A
  kPeff,   ///< e: position exchange with force, F_am of law d plus F_e / A
};
inline constexpr std::size_t kBilateralLaws = 5;

/// Returns the short name as used in configuration: pf, sctfb, pfff, pe, peff.
const char* name_of(BilateralLaw law) noexcept;
std::optional<BilateralLaw> law_from_name(std::string_view name) noexcept;
/// Returns whether the law uses F_e, which the slave then has to measure (c, e).
bool needs_force_sensor(BilateralLaw law) noexcept;

/// Motion of master or slave, per joint, in the slave's joint coordinates: rad or m, rad/s or m/s.
struct JointMotion {
  core::JointArray position{};
  core::JointArray velocity{};
};

/// Torques that the slave reports, per joint.
struct SlaveEffort {
  core::JointArray loop_torque_Nm{};  ///< F_as
  core::JointArray
      external_torque_Nm{};  ///< F_e: exerted on the arm by its surroundings, as joint torques Jᵀf
};

/// Gains of the master's own position loop (laws d and e), N·m/rad and N·m·s/rad, or N/m and N·s/m, and the
/// share of F_e in law e.
struct ExchangeGains {
  core::JointArray k_p{};  ///< K_pm ≥ 0
  core::JointArray k_v{};  ///< K_vm ≥ 0
  double force_share =
      1.0;  ///< factor of F_e in law e, ≥ 0; 1: as in the table, for a slave as strong as its master
};

/// Returns the torque of the slave's feedback on the master's joints by Table 5.1. It is −F_am, since F_am is
/// the force that the hand has to overcome. `inverse_a` is 1/A ≥ 0 of each joint and scales the whole torque.
/// With 1/A = 1 and a force share of 1, laws d and e are those of the table. The velocity term of d and e
/// uses the difference between the two sides, so that common motion needs no force. Real-time safe: yes.
core::JointArray feedback_torque(BilateralLaw law, const JointMotion& master, const JointMotion& slave,
                                 const SlaveEffort& effort, const ExchangeGains& gains,
                                 const core::JointArray& inverse_a, std::size_t joint_count) noexcept;

}  // namespace phantom::teleop

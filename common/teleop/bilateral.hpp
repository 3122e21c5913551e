#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

#include "common/core/joints.hpp"

namespace phantom::teleop {

/// Bilateral laws of the thesis's Table 5.1. In all of them the slave follows with F_as = K_ps(X_m − X_s) +
/// K_vs·(Ẋ_m − Ẋ_s); they differ in F_am, what the hand feels of the slave.
enum class BilateralLaw : std::uint8_t {
  kPf,     ///< a: position forward, F_am = 0
  kSctfb,  ///< b: slave coordinating torque feedback, F_am = F_as / A
  kPfff,   ///< c: position forward, force feedback, F_am = F_e / A
  kPe,     ///< d: position exchange, F_am = (K_pm(X_m − X_s) + K_vm(Ẋ_m − Ẋ_s)) / A
  kPeff,   ///< e: position exchange with force, d's and F_e / A
};
inline constexpr std::size_t kBilateralLaws = 5;

/// Short name as used in configuration: pf, sctfb, pfff, pe, peff.
const char* name_of(BilateralLaw law) noexcept;
std::optional<BilateralLaw> law_from_name(std::string_view name) noexcept;
/// Whether the law feels F_e, so that the slave has to measure it (c, e).
bool needs_force_sensor(BilateralLaw law) noexcept;

/// One side of the pair, per joint, in the slave's joint coordinates: rad or m, rad/s or m/s.
struct JointMotion {
  core::JointArray position{};
  core::JointArray velocity{};
};

/// What the slave reports of itself, per joint.
struct SlaveEffort {
  core::JointArray loop_torque_Nm{};  ///< F_as
  core::JointArray
      external_torque_Nm{};  ///< F_e: what its surroundings exert on the arm, as joint torques Jᵀf
};

/// The master's own position loop (laws d and e), N·m/rad and N·m·s/rad, or N/m and N·s/m, and what joins it
/// in e.
struct ExchangeGains {
  core::JointArray k_p{};    ///< K_pm ≥ 0
  core::JointArray k_v{};    ///< K_vm ≥ 0
  double force_share = 1.0;  ///< of F_e in e, ≥ 0; 1: as in the table, for a slave as strong as its master
};

/// Torque that the slave's feedback puts on the master's joints, by Table 5.1: −F_am, since F_am is what the
/// hand has to overcome. `inverse_a` is 1/A ≥ 0 of each joint and scales all of it; with 1 (and a force share
/// of 1) the laws d and e are the table's. The table's velocity term of d and e is taken between the two
/// sides, so that common motion costs nothing. Real-time safe: yes.
core::JointArray feedback_torque(BilateralLaw law, const JointMotion& master, const JointMotion& slave,
                                 const SlaveEffort& effort, const ExchangeGains& gains,
                                 const core::JointArray& inverse_a, std::size_t joint_count) noexcept;

}  // namespace phantom::teleop

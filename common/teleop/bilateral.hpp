#pragma once

#include <cstddef>
#include <optional>
#include <string_view>

#include "common/core/joints.hpp"

namespace phantom::teleop {

/// Bilateral laws of the thesis's Table 5.1. In all of them the slave follows with F_as = K_ps(X_m − X_s) +
/// K_vs·(Ẋ_m − Ẋ_s); they differ in F_am, what the hand feels of the slave.
enum class BilateralLaw {
  kPf,     ///< a: position forward, F_am = 0
  kSctfb,  ///< b: slave coordinating torque feedback, F_am = F_as / A
  kPfff,   ///< c: position forward, force feedback, F_am = F_e / A
  kPe,     ///< d: position exchange
  kPeff,   ///< e: position exchange with force
};

/// Short name as used in configuration: pf, sctfb, pfff, pe, peff.
const char* name_of(BilateralLaw law) noexcept;
std::optional<BilateralLaw> law_from_name(std::string_view name) noexcept;
/// Whether this version renders the law. kPf and kSctfb; a configuration that asks for another one is
/// refused.
bool is_supported(BilateralLaw law) noexcept;

/// What the slave reports of itself, per joint.
struct SlaveEffort {
  core::JointArray loop_torque_Nm{};  ///< F_as
};

/// Torque that the slave's feedback puts on the master's joints: −F_am, as the reaction to F_as pulls the
/// master back to the slave. `inverse_a` is 1/A ≥ 0. Zero for laws that are not supported. Real-time safe:
/// yes.
core::JointArray feedback_torque(BilateralLaw law, const SlaveEffort& slave, double inverse_a,
                                 std::size_t joint_count) noexcept;

/// Sum on the master's joint, eq. 5.20: percept torque (already G·τ₁) plus feedback (already τ₂/A), within
/// the device's torque limit. Real-time safe: yes.
core::JointArray master_torque(const core::JointArray& percept_Nm, const core::JointArray& feedback_Nm,
                               const core::JointArray& limit_Nm, std::size_t joint_count) noexcept;

}  // namespace phantom::teleop

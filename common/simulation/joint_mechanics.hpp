#pragma once

#include <array>

#include "common/core/joints.hpp"

namespace phantom::simulation {

/// Parameters of one simulated joint: inertia seen at the joint (links and rotor), friction and end stops.
/// Units of a revolute joint: kg·m², N·m·s/rad, N·m, rad; of a prismatic joint: kg, N·s/m, N, m.
struct JointMechanics {
  double inertia = 1.0;  ///< > 0
  double viscous = 0.0;  ///< ≥ 0
  double coulomb = 0.0;  ///< ≥ 0
  double lower = -1e9;
  double upper = 1e9;
};

using ArmMechanics = std::array<JointMechanics, core::kMaxJoints>;

/// Advances position `q` and velocity `v` by one semi-implicit Euler step under `torque`.
///
/// Coulomb friction acts as an impulse that can bring the joint to rest but never reverse it. At rest it
/// balances any torque up to its value, without chatter and without a velocity threshold. Viscous friction is
/// implicit, so it is stable for any step. The end stops are inelastic. Without torque |v| never grows.
/// Real-time safe: yes.
inline void integrate(const JointMechanics& joint, double torque, double dt_s, double& q,
                      double& v) noexcept {
  const double per_inertia_s = dt_s / joint.inertia;
  v += per_inertia_s * torque;
  const double stopping = per_inertia_s * joint.coulomb;
  v = v > stopping ? v - stopping : v < -stopping ? v + stopping : 0.0;
  v /= 1.0 + per_inertia_s * joint.viscous;
  q += dt_s * v;
  if (q > joint.upper) {
    q = joint.upper;
    v = v > 0.0 ? 0.0 : v;
  } else if (q < joint.lower) {
    q = joint.lower;
    v = v < 0.0 ? 0.0 : v;
  }
}

}  // namespace phantom::simulation

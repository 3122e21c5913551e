#pragma once

#include "common/teleop/bilateral.hpp"

namespace phantom::teleop {

/// Importance of a percept beside a bilateral law.
enum class PerceptRole {
  kHelpful,    ///< effective, but not needed
  kEssential,  ///< needed, because nothing else conveys vicinity
  kWeak        ///< cannot be told apart from the law's own feedback
};

/// A row of the thesis's Table 6.1: the importance of each percept for one law.
struct PerceptSet {
  PerceptRole haptic;  ///< HAVP: drag on the master
  PerceptRole audio;   ///< DFAP: the tone
  PerceptRole view;    ///< VADP: hit-zone views
  const char* reason;  ///< one sentence for the operator
};

/// Returns the default percepts for a law. `balanced`: the slave's weight is not felt in its loop torque
/// (cases b1 and d1; an unbalanced arm in case b is b2). Source: Table 6.1 and section 6.11.1.
PerceptSet percept_set(BilateralLaw law, bool balanced) noexcept;

/// Returns whether drag can be told apart from the law's own feedback: Table 6.1 has no haptic percept
/// otherwise (cases d and e). Tone and views help beside every law.
inline bool drag_stands_apart(BilateralLaw law) noexcept {
  return percept_set(law, true).haptic != PerceptRole::kWeak;
}

const char* name_of(PerceptRole role) noexcept;

}  // namespace phantom::teleop

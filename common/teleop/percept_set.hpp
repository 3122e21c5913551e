#pragma once

#include "common/teleop/bilateral.hpp"

namespace phantom::teleop {

/// How much a percept adds to a bilateral law.
enum class PerceptRole {
  kHelpful,    ///< effective beside it, not needed
  kEssential,  ///< needed: nothing else conveys vicinity
  kWeak        ///< does not stand apart from the law's own feedback
};

/// The thesis's Table 6.1 for one law.
struct PerceptSet {
  PerceptRole haptic;  ///< HAVP: drag on the master
  PerceptRole audio;   ///< DFAP: the tone
  PerceptRole view;    ///< VADP: hit-zone views
  const char* reason;  ///< one sentence for the operator
};

/// The default set of percepts for a law. `balanced`: the slave's weight is not felt in its loop torque
/// (cases b1 and d1; an unbalanced arm in case b is b2). Source: Table 6.1 and section 6.11.1.
PerceptSet percept_set(BilateralLaw law, bool balanced) noexcept;

const char* name_of(PerceptRole role) noexcept;

}  // namespace phantom::teleop

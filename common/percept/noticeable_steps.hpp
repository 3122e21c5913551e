#pragma once

#include <string>
#include <vector>

#include "common/workspace/profile.hpp"

namespace phantom::percept {

/// A step of viscosity that a sensor passes on its way into a body.
struct LayerStep {
  std::string outer, inner;  ///< "layer 3", "boundary", "layer -2", "interior", "medium"
  double outer_mu_Pa_s_per_m = 0.0, inner_mu_Pa_s_per_m = 0.0;
  double fraction = 0.0;  ///< inner ÷ outer viscosity − 1, the medium's added to both
};

/// Returns the steps between neighbouring layers of a profile, from the outermost layer into the body.
/// `medium_mu_Pa_s_per_m` ≥ 0: of the medium around the body, which adds to all layers; above 0 the first
/// step is that from the medium alone. From free space to a layer there is no Weber fraction. The guard has
/// layer 1's viscosity, so it makes no step of its own. The profile must have been checked.
std::vector<LayerStep> layer_steps(const workspace::LayerProfile& profile, double medium_mu_Pa_s_per_m = 0.0);

/// Returns each step below an operator's Weber fraction of viscosity (Staircase), for a message: "from layer
/// 6 to layer 5 (9 to 10 Pa·s/m, 11.1 %)". She does not feel it as a step, even where all sensors take it at
/// once. Empty: all steps are felt.
std::vector<std::string> unnoticed_steps(const workspace::LayerProfile& profile, double weber_fraction,
                                         double medium_mu_Pa_s_per_m = 0.0);

}  // namespace phantom::percept

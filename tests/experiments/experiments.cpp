#include "tests/experiments/experiment.hpp"

namespace phantom::experiments {

// One function per experiment, in a file of its own name.
Experiment mpc_steps();

const std::vector<Experiment>& experiments() {
  static const std::vector<Experiment> all{
      mpc_steps(),
  };
  return all;
}

}  // namespace phantom::experiments

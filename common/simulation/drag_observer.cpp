#include "common/simulation/drag_observer.hpp"

#include <cmath>

namespace phantom::simulation {

bool DragObserver::calls_first_greater(double first, double second) noexcept {
  const double first_felt = std::log(first) + parameters_.ln_noise * noise_(random_),
               second_felt = std::log(second) + parameters_.ln_noise * noise_(random_);
  const bool lapses = share_(random_) < parameters_.lapse_share, guess = share_(random_) < 0.5;
  return lapses ? guess : first_felt > second_felt;
}

}  // namespace phantom::simulation

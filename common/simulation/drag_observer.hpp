#pragma once

#include <cstdint>
#include <random>

namespace phantom::simulation {

struct DragObserverParameters {
  /// Standard deviation of the noise on the logarithm of what she feels, in each interval: alike at all
  /// intensities, as Weber's law has it.
  double ln_noise = 0.1;
  double lapse_share = 0.0;  ///< of the intervals' pairs that she does not attend to, and guesses
  std::uint32_t seed = 1;
};

/// Simulates a person who compares two drags: she feels the damping coefficient of each with noise, and calls
/// the greater one. The same inputs and seed give the same answers. Not real-time safe.
class DragObserver {
 public:
  explicit DragObserver(const DragObserverParameters& parameters) noexcept
      : parameters_(parameters), random_(parameters.seed) {}

  /// Returns whether she calls the first greater. Both are damping coefficients of the same unit, above 0.
  bool calls_first_greater(double first, double second) noexcept;

 private:
  DragObserverParameters parameters_;
  std::mt19937 random_;
  std::normal_distribution<double> noise_;
  std::uniform_real_distribution<double> share_;
};

}  // namespace phantom::simulation

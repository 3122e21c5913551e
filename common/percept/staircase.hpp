#pragma once

#include <cstdint>
#include <optional>
#include <random>
#include <vector>

#include "common/core/status.hpp"

namespace phantom::percept {

/// How a just noticeable difference is measured.
struct StaircaseParameters {
  /// So many right answers in succession make the next difference smaller, one wrong answer makes it greater:
  /// 2 to 5. With n the differences settle where a share of 2^(−1/n) of the answers is right.
  int right_to_descend = 3;
  double first_fraction = 1.0;     ///< of the first comparison: greater intensity ÷ lesser one − 1
  double least_fraction = 0.005;   ///< 0.001 to first_fraction
  double greatest_fraction = 4.0;  ///< first_fraction to 10
  double first_step = 2.0;  ///< factor between differences until `coarse_reversals` have passed; above 1
  double step = 1.4;        ///< the same from then on; above 1
  int coarse_reversals = 2;
  int reversals = 12;         ///< turns of direction after which it ends, above coarse_reversals
  int most_trials = 200;      ///< it ends after so many at the latest
  double lapse_share = 0.02;  ///< of the answers that do not depend on what was felt, 0 to 0.2
  std::uint32_t seed = 1;     ///< of the order of the intervals
};

/// Checks the parameters; the message of an error names the parameter and what is allowed.
core::Status check_staircase(const StaircaseParameters& parameters);

/// Share of right answers at which the differences settle: 2^(−1/n) (Levitt 1971). Its inputs are those of
/// StaircaseParameters.
double tracked_share(int right_to_descend) noexcept;

/// One trial: two intervals of different intensity in random order.
struct Comparison {
  double fraction = 0.0;       ///< greater intensity ÷ lesser one − 1
  bool greater_first = false;  ///< which interval has the greater one
};

/// A just noticeable difference as a Weber fraction: least noticed change ÷ intensity.
struct JustNoticeable {
  double fraction = 0.0;            ///< at which `share_right` of the answers is right
  double lower = 0.0, upper = 0.0;  ///< it lies between these with a probability of 95 %
  double share_right = 0.0;
  double mean_of_reversals = 0.0;  ///< the same without a model of the observer; 0: too few reversals
  int trials = 0, reversals = 0;
};

/// Measures the just noticeable difference of an intensity: an adaptive staircase (transformed up-down method
/// with two-alternative forced choice; H. Levitt, J. Acoust. Soc. Am. 49, 1971, 467) chooses the comparisons.
/// All answers together give the threshold (J. L. Hall, J. Acoust. Soc. Am. 69, 1981, 1763).
///
/// The model behind the threshold is Weber's law: an observer compares the logarithms of two intensities,
/// each with Gaussian noise. With d = ln(first ÷ second), the first is called greater with the probability
/// λ/2 + (1 − λ)·Φ(z·d/θ). λ is lapse_share, θ the threshold's logarithm, z such that share_right results at
/// d = θ. The threshold is the median of its probability after all answers; before the first, each ln θ is as
/// probable as another. Knows no clock and no device. Not real-time safe.
class Staircase {
 public:
  /// The parameters must have been checked.
  explicit Staircase(const StaircaseParameters& parameters);

  /// Returns the comparison to be made next; nothing once the measurement has ended.
  std::optional<Comparison> next() const;
  /// Records the answer to next(): whether the first interval was called the greater one. `ln_ratio`: ln of
  /// first ÷ second intensity as they were really given. The measurement must not have ended.
  void answer(bool first_called_greater, double ln_ratio);

  bool ended() const noexcept;
  /// Returns whether it has made all its reversals, and the threshold is below the greatest difference that
  /// it may give: answers by chance settle nowhere.
  bool settled() const;
  JustNoticeable result() const;

 private:
  void move(bool right);
  void draw_order();

  StaircaseParameters parameters_;
  std::mt19937 random_;
  Comparison comparison_;
  int right_in_succession_ = 0, direction_ = 0, reversals_ = 0, trials_ = 0;
  double share_right_, z_;
  std::vector<double> thresholds_, ln_likelihood_;  // θ on a grid that is even in ln θ
  std::vector<double> reversal_ln_fractions_;       // after the coarse ones
};

/// Standard deviation of the noise on the logarithm of one intensity, of an observer who tells two
/// intensities of that Weber fraction apart with `share_right` of right answers.
double ln_noise_of(double fraction, double share_right, double lapse_share) noexcept;

}  // namespace phantom::percept

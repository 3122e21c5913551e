#include "common/percept/staircase.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "common/core/text.hpp"

namespace phantom::percept {
namespace {

constexpr double kLeastThreshold = 0.0005, kGreatestThreshold = 4.0;  // ln θ, on a grid
constexpr int kGridSize = 800;

/// The normal distribution Φ.
double normal_share(double z) { return 0.5 * std::erfc(-z / std::numbers::sqrt2); }

/// Its inverse, for shares from 0.5 to below 1.
double normal_quantile(double share) {
  double low = 0.0, high = 9.0;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (normal_share(middle) < share ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

/// z at which so many answers are right, lapses counted.
double quantile_with_lapses(double share_right, double lapse_share) {
  return normal_quantile((share_right - 0.5 * lapse_share) / (1.0 - lapse_share));
}

core::Status out_of_range(const char* name, double value, double least, double greatest) {
  return core::Status::invalid_argument(
      core::formatted("staircase: %s is %g; allowed: %g to %g", name, value, least, greatest));
}

}  // namespace

core::Status check_staircase(const StaircaseParameters& p) {
  const struct {
    const char* name;
    double value, least, greatest;
  } rules[] = {
      {"right_to_descend", static_cast<double>(p.right_to_descend), 2, 5},
      {"first_fraction", p.first_fraction, 0.001, 10},
      {"least_fraction", p.least_fraction, 0.001, p.first_fraction},
      {"greatest_fraction", p.greatest_fraction, p.first_fraction, 10},
      {"first_step", p.first_step, 1.01, 10},
      {"step", p.step, 1.01, 10},
      {"coarse_reversals", static_cast<double>(p.coarse_reversals), 0, 100},
      {"reversals", static_cast<double>(p.reversals), p.coarse_reversals + 1.0, 1000},
      {"most_trials", static_cast<double>(p.most_trials), 1, 100000},
      {"lapse_share", p.lapse_share, 0, 0.2},
  };
  for (const auto& rule : rules)
    if (!(rule.value >= rule.least && rule.value <= rule.greatest))
      return out_of_range(rule.name, rule.value, rule.least, rule.greatest);
  return core::Status::ok();
}

double tracked_share(int right_to_descend) noexcept { return std::pow(0.5, 1.0 / right_to_descend); }

double ln_noise_of(double fraction, double share_right, double lapse_share) noexcept {
  return std::log1p(fraction) / (std::numbers::sqrt2 * quantile_with_lapses(share_right, lapse_share));
}

Staircase::Staircase(const StaircaseParameters& parameters)
    : parameters_(parameters),
      random_(parameters.seed),
      comparison_{parameters.first_fraction, false},
      share_right_(tracked_share(parameters.right_to_descend)),
      z_(quantile_with_lapses(share_right_, parameters.lapse_share)),
      thresholds_(kGridSize),
      ln_likelihood_(kGridSize, 0.0) {
  const double first = std::log(kLeastThreshold), last = std::log(kGreatestThreshold);
  for (int i = 0; i < kGridSize; ++i) thresholds_[i] = std::exp(first + (last - first) * i / (kGridSize - 1));
  draw_order();
}

void Staircase::draw_order() { comparison_.greater_first = (random_() & 0x8000U) != 0; }

bool Staircase::ended() const noexcept {
  return reversals_ >= parameters_.reversals || trials_ >= parameters_.most_trials;
}

bool Staircase::settled() const {
  return reversals_ >= parameters_.reversals && result().fraction < parameters_.greatest_fraction;
}

std::optional<Comparison> Staircase::next() const {
  return ended() ? std::nullopt : std::optional(comparison_);
}

void Staircase::answer(bool first_called_greater, double ln_ratio) {
  const double lapse = parameters_.lapse_share, signed_ratio = first_called_greater ? ln_ratio : -ln_ratio;
  for (std::size_t i = 0; i < thresholds_.size(); ++i) {
    const double share = 0.5 * lapse + (1.0 - lapse) * normal_share(z_ * signed_ratio / thresholds_[i]);
    ln_likelihood_[i] += std::log(std::max(share, 1e-300));
  }
  ++trials_;
  move(first_called_greater == comparison_.greater_first);
  draw_order();
}

void Staircase::move(bool right) {
  right_in_succession_ = right ? right_in_succession_ + 1 : 0;
  if (right && right_in_succession_ < parameters_.right_to_descend) return;
  right_in_succession_ = 0;
  const int direction = right ? -1 : 1;
  if (direction_ != 0 && direction != direction_) {
    ++reversals_;
    if (reversals_ > parameters_.coarse_reversals)
      reversal_ln_fractions_.push_back(std::log(comparison_.fraction));
  }
  direction_ = direction;
  const double step = reversals_ < parameters_.coarse_reversals ? parameters_.first_step : parameters_.step;
  comparison_.fraction = std::clamp(comparison_.fraction * (right ? 1.0 / step : step),
                                    parameters_.least_fraction, parameters_.greatest_fraction);
}

JustNoticeable Staircase::result() const {
  JustNoticeable found{.share_right = share_right_, .trials = trials_, .reversals = reversals_};
  const double most = *std::max_element(ln_likelihood_.begin(), ln_likelihood_.end());
  std::vector<double> below(ln_likelihood_.size());
  double sum = 0.0;
  for (std::size_t i = 0; i < below.size(); ++i) below[i] = sum += std::exp(ln_likelihood_[i] - most);
  const auto quantile = [&](double share) {
    const auto at = std::lower_bound(below.begin(), below.end(), share * sum) - below.begin();
    return std::expm1(thresholds_[static_cast<std::size_t>(at)]);
  };
  found.fraction = quantile(0.5);
  found.lower = quantile(0.025);
  found.upper = quantile(0.975);
  if (!reversal_ln_fractions_.empty())
    found.mean_of_reversals =
        std::exp(std::accumulate(reversal_ln_fractions_.begin(), reversal_ln_fractions_.end(), 0.0) /
                 static_cast<double>(reversal_ln_fractions_.size()));
  return found;
}

}  // namespace phantom::percept

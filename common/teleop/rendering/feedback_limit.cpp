#include "common/teleop/rendering/feedback_limit.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>

#include "common/core/text.hpp"

namespace phantom::teleop {
namespace {

using Complex = std::complex<double>;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kLowest_rad_s = 0.2;
constexpr int kFrequencies = 600;
// Where the phase turns further than this between two frequencies, the crossings are not searched one by one.
constexpr double kTurn_rad = std::numbers::pi / 3.0;

// Response of a torque that is held for one period and acts `samples` periods later.
Complex hold(double omega_rad_s, double period_s, int samples) {
  const double half = 0.5 * omega_rad_s * period_s;
  return std::polar(half > 0.0 ? std::sin(half) / half : 1.0, -half * (1.0 + 2.0 * samples));
}

// Response of a first-order filter of samples, as Encoders and MomentumObserver have it.
Complex filtered(double omega_rad_s, double period_s, double filter_s) {
  const double share = period_s / (period_s + filter_s);
  return share / (1.0 - (1.0 - share) * std::polar(1.0, -omega_rad_s * period_s));
}

// Response of sample differences through such a filter, as Encoders computes velocities.
Complex filtered_rate(double omega_rad_s, double period_s, double filter_s) {
  const Complex back = std::polar(1.0, -omega_rad_s * period_s);
  return (1.0 - back) / period_s * filtered(omega_rad_s, period_s, filter_s);
}

// F(jω) behind the master's hold = at_once + answered·e^(−jωτ).
struct Stiffness {
  Complex at_once, answered;
};

Stiffness stiffness_at(BilateralLaw law, const FeedbackLoop& loop, bool held, double omega_rad_s) {
  const Complex master_rate = filtered_rate(omega_rad_s, loop.master_period_s, loop.master_filter_s);
  const Complex slave_rate = filtered_rate(omega_rad_s, loop.slave_period_s, loop.slave_filter_s);
  const Complex commanded = loop.slave_k_p + loop.slave_k_v * master_rate;
  // Motion and loop torque of the slave per unit of the master's motion.
  Complex moved = 0.0, torque = commanded;
  if (!held) {
    const Complex plant = hold(omega_rad_s, loop.slave_period_s, loop.slave_delay_samples) /
                          (-loop.slave_inertia * omega_rad_s * omega_rad_s);
    torque = commanded / (1.0 + plant * (loop.slave_k_p + loop.slave_k_v * slave_rate));
    moved = plant * torque;
  }
  // −F_e: a free slave feels no external force.
  const Complex force = held ? torque * filtered(omega_rad_s, loop.slave_period_s, loop.force_lag_s) : 0.0;
  const bool exchange = law == BilateralLaw::kPe || law == BilateralLaw::kPeff;
  Stiffness f{0.0, 0.0};
  if (law == BilateralLaw::kSctfb) f.answered += torque;
  if (needs_force_sensor(law)) f.answered += (exchange ? loop.force_share : 1.0) * force;
  if (exchange) {
    f.at_once = loop.exchange_k_p + loop.exchange_k_v * master_rate;
    f.answered -= (loop.exchange_k_p + loop.exchange_k_v * slave_rate) * moved;
  }
  const Complex acts = hold(omega_rad_s, loop.master_period_s, loop.master_delay_samples);
  return {f.at_once * acts, f.answered * acts};
}

struct Response {
  std::array<double, kFrequencies> omega_rad_s;
  std::array<Stiffness, kFrequencies> stiffness;
};

Response response_of(BilateralLaw law, const FeedbackLoop& loop, bool held) {
  Response response;
  const double highest_rad_s =
      std::numbers::pi / std::max(loop.master_period_s, loop.slave_period_s) * (1.0 - 1e-9);
  for (int i = 0; i < kFrequencies; ++i) {
    const double omega =
        kLowest_rad_s * std::pow(highest_rad_s / kLowest_rad_s, static_cast<double>(i) / (kFrequencies - 1));
    const auto k = static_cast<std::size_t>(i);
    response.omega_rad_s[k] = omega;
    response.stiffness[k] = stiffness_at(law, loop, held, omega);
  }
  return response;
}

double limit_of(const Response& response, double inertia, double round_trip_s) {
  double limit = kInfinity;
  Complex before;
  for (std::size_t i = 0; i < kFrequencies; ++i) {
    const double omega = response.omega_rad_s[i];
    const Stiffness& f = response.stiffness[i];
    const Complex now = f.at_once + f.answered * std::polar(1.0, -omega * round_trip_s);
    const double inert = inertia * omega * omega;
    const double greatest = std::abs(f.at_once) + std::abs(f.answered);
    if (i == 0) {
      // A spring whose force lags its deflection generates energy at any gain.
      if (now.real() > 0.0 && now.imag() < -1e-9 * std::abs(now)) return 0.0;
    } else if ((omega - response.omega_rad_s[i - 1]) * round_trip_s > kTurn_rad) {
      if (greatest > 0.0) limit = std::min(limit, inert / greatest);
    } else if (before.imag() * now.imag() < 0.0) {
      const double share = before.imag() / (before.imag() - now.imag());
      const double real = before.real() + share * (now.real() - before.real());
      const double at = response.omega_rad_s[i - 1] + share * (omega - response.omega_rad_s[i - 1]);
      if (real > 0.0) limit = std::min(limit, inertia * at * at / real);
    }
    before = now;
  }
  return limit;
}

}  // namespace

double feedback_limit(BilateralLaw law, const FeedbackLoop& loop, double round_trip_s) noexcept {
  if (law == BilateralLaw::kPf) return kInfinity;
  double limit = kInfinity;
  for (const bool held : {false, true}) {
    limit = std::min(limit, limit_of(response_of(law, loop, held), loop.master_inertia, round_trip_s));
  }
  return limit;
}

double FeedbackLimits::node_s(std::size_t node) noexcept {
  return kMin_s * std::pow(kMax_s / kMin_s, static_cast<double>(node) / static_cast<double>(kNodes - 1));
}

FeedbackLimits::FeedbackLimits(const std::vector<FeedbackLoop>& joints)
    : joints_(std::min(joints.size(), core::kMaxJoints)) {
  for (std::size_t law = 0; law < kBilateralLaws; ++law) {
    for (std::size_t j = 0; j < joints_; ++j) {
      auto& usable = usable_[law][j];
      usable.fill(kInfinity);
      if (static_cast<BilateralLaw>(law) == BilateralLaw::kPf) continue;
      for (const bool held : {false, true}) {
        const Response response = response_of(static_cast<BilateralLaw>(law), joints[j], held);
        for (std::size_t n = 0; n < kNodes; ++n) {
          const double limit = limit_of(response, joints[j].master_inertia, node_s(n));
          usable[n] = std::min(usable[n], kUsableShareOfFeedbackLimit * limit);
        }
      }
      // The delay is only an estimate, so a longer delay must never allow a greater gain.
      for (std::size_t n = 1; n < kNodes; ++n) usable[n] = std::min(usable[n], usable[n - 1]);
    }
  }
}

double FeedbackLimits::usable(BilateralLaw law, std::size_t joint, double round_trip_s) const noexcept {
  if (joint >= joints_ || law == BilateralLaw::kPf) return kInfinity;
  if (!(round_trip_s <= kMax_s)) return 0.0;
  const auto& usable = usable_[static_cast<std::size_t>(law)][joint];
  const double place = std::log(std::max(round_trip_s, kMin_s) / kMin_s) / std::log(kMax_s / kMin_s) *
                       static_cast<double>(kNodes - 1);
  const auto node = std::min(static_cast<std::size_t>(std::max(place, 0.0)), kNodes - 2);
  if (!std::isfinite(usable[node]) || usable[node + 1] == 0.0) return usable[node + 1];
  const double share = std::clamp(place - static_cast<double>(node), 0.0, 1.0);
  return usable[node] + share * (usable[node + 1] - usable[node]);
}

std::string why_feedback_is_unstable(const FeedbackLimits& limits, BilateralLaw law,
                                     const core::JointArray& inverse_a, double contact_ratio,
                                     double round_trip_s, const std::vector<std::string>& names) {
  double least = kInfinity, asked = 0.0;
  std::size_t joint = names.size();
  for (std::size_t j = 0; j < names.size(); ++j) {
    const double allowed = limits.usable(law, j, round_trip_s) / contact_ratio;
    if (inverse_a[j] <= allowed || allowed >= least) continue;
    least = allowed;
    asked = inverse_a[j];
    joint = j;
  }
  if (joint == names.size()) return "";
  // Rounded down, so that the reported limit is itself accepted.
  const double digit = least > 0.0 ? std::pow(10.0, std::floor(std::log10(least)) - 1.0) : 1.0;
  return core::formatted("1/A %.3g is not stable on %.32s with law %s and %.3g ms delay; allowed: up to %.2g",
                         asked, names[joint].c_str(), name_of(law), 1e3 * round_trip_s,
                         std::floor(least / digit * (1.0 + 1e-12)) * digit);
}

}  // namespace phantom::teleop

#include "common/teleop/rendering/percept_rendering.hpp"

#include <algorithm>
#include <cmath>

namespace phantom::teleop {
namespace {

bool is_finite(const DragCoefficients& drag, std::size_t count, DragMode mode) noexcept {
  if (!core::all_finite(drag.plus, count) || !core::all_finite(drag.minus, count)) return false;
  if (!core::all_finite(drag.drift, count)) return false;
  if (mode == DragMode::kSeparable) return true;
  const std::size_t entries = count * (count + 1) / 2;
  return std::all_of(drag.coupled.begin(), drag.coupled.begin() + static_cast<std::ptrdiff_t>(entries),
                     [](double entry) { return std::isfinite(entry); });
}

bool are_gains(const core::JointArray& gain, std::size_t count) noexcept {
  return std::all_of(gain.begin(), gain.begin() + static_cast<std::ptrdiff_t>(count),
                     [](double g) { return std::isfinite(g) && g >= 0.0; });
}

double least(const core::JointArray& gain, std::size_t count) noexcept {
  return count == 0 ? 0.0
                    : *std::min_element(gain.begin(), gain.begin() + static_cast<std::ptrdiff_t>(count));
}

}  // namespace

PerceptRenderer::PerceptRenderer(const PerceptParameters& parameters)
    : parameters_(parameters), authority_(parameters.ramp_up_s, parameters.ramp_down_s) {}

RenderedPercept PerceptRenderer::step(const DragCoefficients& drag, bool fresh, bool enabled,
                                      const core::JointArray& gain, const core::JointArray& v, double dt_s,
                                      double limit_share) noexcept {
  RenderedPercept out;
  const std::size_t count = parameters_.joint_count;
  const bool separable = parameters_.mode == DragMode::kSeparable;
  const bool usable =
      fresh && drag.valid && are_gains(gain, count) && is_finite(drag, count, parameters_.mode);
  out.authority = authority_.step(usable && enabled, dt_s);
  if (usable) set_limits(drag, limit_share);
  if (usable) separable ? aim_separable(drag, gain) : aim_coupled(drag, gain);
  out.gain = aimed_gain_;
  out.damping_limited = aim_limited_ && out.authority > 0.0;
  if (out.authority == 0.0) {
    force_ = {};  // the next percept starts from zero
    if (!usable) aim_ = {};
    return out;
  }
  smooth(dt_s);
  if (!core::all_finite(v, count)) return out;
  out.torque_Nm = robot::drag_torque(force_, parameters_.mode, v, count);
  for (std::size_t j = 0; j < count; ++j) out.torque_Nm[j] *= out.authority;
  separable ? cap_each(out) : cap_as_one(v, out);
  return out;
}

// Against a current drag_torque() renders up to twice the coefficient. In the coupled law one joint's drift
// does so to all.
void PerceptRenderer::set_limits(const DragCoefficients& drag, double limit_share) noexcept {
  const std::size_t count = parameters_.joint_count;
  const auto drifts = [&](std::size_t j) { return drag.drift[j] != 0.0; };
  bool some = false;
  for (std::size_t j = 0; j < count; ++j) some = some || drifts(j);
  const bool coupled = parameters_.mode == DragMode::kCoupled;
  for (std::size_t j = 0; j < count; ++j) {
    const double share = (coupled ? some : drifts(j)) ? 0.5 * limit_share : limit_share;
    limit_[j] = share * parameters_.damping_limit_Nms_per_rad[j];
  }
  aim_.drift = drag.drift;
}

// Limits each joint on its own, so that the low limit of a light wrist does not reduce the percept on the
// shoulder.
void PerceptRenderer::aim_separable(const DragCoefficients& drag, const core::JointArray& gain) noexcept {
  aimed_gain_ = least(gain, parameters_.joint_count);
  aim_limited_ = false;
  for (std::size_t j = 0; j < parameters_.joint_count; ++j) {
    const double limit = limit_[j];
    const double plus = gain[j] * std::max(0.0, drag.plus[j]);
    const double minus = gain[j] * std::max(0.0, drag.minus[j]);
    aim_.plus[j] = std::min(plus, limit);
    aim_.minus[j] = std::min(minus, limit);
    const double greatest = std::max(plus, minus);
    if (greatest > limit) {
      aim_limited_ = true;
      aimed_gain_ = std::min(aimed_gain_, gain[j] * limit / greatest);
    }
  }
}

// Returns an upper bound of the matrix's greatest eigenvalue in coordinates scaled by √limit: the greatest
// row sum of magnitudes (Gershgorin). B± are at most D's diagonal, so no row of S·D·S has a greater sum than
// D's.
double PerceptRenderer::greatest_row(const DragCoefficients& drag) const noexcept {
  double bound = 0.0;
  for (std::size_t i = 0; i < parameters_.joint_count; ++i) {
    double row = 0.0;
    for (std::size_t j = 0; j < parameters_.joint_count; ++j) {
      if (drag.matrix(i, j) == 0.0) continue;  // avoids 0 ÷ 0 for a joint that may not be damped at all
      row += std::abs(drag.matrix(i, j)) / std::sqrt(limit_[i] * limit_[j]);
    }
    bound = std::max(bound, row);
  }
  return bound;
}

// Limits the matrix as a whole; otherwise it would not stay positive semi-definite.
void PerceptRenderer::aim_coupled(const DragCoefficients& drag, const core::JointArray& gain) noexcept {
  const std::size_t count = parameters_.joint_count;
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      const std::size_t k = i * (i + 1) / 2 + j;
      aim_.coupled[k] = (i == j ? gain[i] : std::sqrt(gain[i] * gain[j])) * drag.coupled[k];
    }
  }
  const double bound = greatest_row(aim_);
  aim_limited_ = bound > 1.0;
  const double share = aim_limited_ ? 1.0 / bound : 1.0;
  aimed_gain_ = share * least(gain, count);
  for (std::size_t k = 0; k < count * (count + 1) / 2; ++k) aim_.coupled[k] *= share;
  for (std::size_t j = 0; j < count; ++j) {
    const double own = std::max(0.0, aim_.matrix(j, j));
    aim_.plus[j] = std::clamp(share * gain[j] * drag.plus[j], 0.0, own);
    aim_.minus[j] = std::clamp(share * gain[j] * drag.minus[j], 0.0, own);
  }
}

void PerceptRenderer::smooth(double dt_s) noexcept {
  const double share = dt_s / (dt_s + parameters_.smoothing_s);
  const std::size_t count = parameters_.joint_count;
  for (std::size_t j = 0; j < count; ++j) {
    force_.plus[j] += share * (aim_.plus[j] - force_.plus[j]);
    force_.minus[j] += share * (aim_.minus[j] - force_.minus[j]);
    force_.drift[j] += share * (aim_.drift[j] - force_.drift[j]);
  }
  if (parameters_.mode == DragMode::kSeparable) return;
  for (std::size_t k = 0; k < count * (count + 1) / 2; ++k)
    force_.coupled[k] += share * (aim_.coupled[k] - force_.coupled[k]);
}

void PerceptRenderer::cap_each(RenderedPercept& out) const noexcept {
  for (std::size_t j = 0; j < parameters_.joint_count; ++j) {
    const double cap = parameters_.torque_cap_Nm[j];
    out.torque_limited = out.torque_limited || std::abs(out.torque_Nm[j]) > cap;
    out.torque_Nm[j] = std::clamp(out.torque_Nm[j], -cap, cap);
  }
}

// Scales all joints by one factor: clamping them one by one could turn drag into a push on another joint.
void PerceptRenderer::cap_as_one(const core::JointArray& v, RenderedPercept& out) const noexcept {
  const std::size_t count = parameters_.joint_count;
  double scale = 1.0, power_W = 0.0;
  for (std::size_t i = 0; i < count; ++i) {
    power_W += out.torque_Nm[i] * v[i];
    const double cap = parameters_.torque_cap_Nm[i];
    if (std::abs(out.torque_Nm[i]) > cap) scale = std::min(scale, cap / std::abs(out.torque_Nm[i]));
  }
  if (!(power_W <= 0.0))
    scale = 0.0;  // the matrix is not positive semi-definite: render nothing rather than push
  out.torque_limited = scale < 1.0;
  for (std::size_t i = 0; i < count; ++i) {
    out.torque_Nm[i] = scale > 0.0 ? scale * out.torque_Nm[i] : 0.0;  // a product may have overflowed
  }
}

}  // namespace phantom::teleop

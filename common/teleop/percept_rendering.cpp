#include "common/teleop/percept_rendering.hpp"

#include <algorithm>
#include <cmath>

namespace phantom::teleop {
namespace {

bool is_finite(const DragCoefficients& drag, std::size_t count, DragMode mode) noexcept {
  if (mode == DragMode::kSeparable)
    return core::all_finite(drag.plus, count) && core::all_finite(drag.minus, count);
  const std::size_t entries = count * (count + 1) / 2;
  return std::all_of(drag.coupled.begin(), drag.coupled.begin() + static_cast<std::ptrdiff_t>(entries),
                     [](double entry) { return std::isfinite(entry); });
}

double entry(const DragCoefficients& drag, std::size_t i, std::size_t j) noexcept {
  return drag.coupled[i >= j ? triangle_index(i, j) : triangle_index(j, i)];
}

}  // namespace

PerceptRenderer::PerceptRenderer(const PerceptParameters& parameters)
    : parameters_(parameters), authority_(parameters.ramp_up_s, parameters.ramp_down_s) {}

RenderedPercept PerceptRenderer::step(const DragCoefficients& drag, bool fresh, bool enabled, double gain,
                                      const core::JointArray& v, double dt_s) noexcept {
  RenderedPercept out;
  const bool usable = fresh && drag.valid && std::isfinite(gain) && gain >= 0.0 &&
                      is_finite(drag, parameters_.joint_count, parameters_.mode);
  out.authority = authority_.step(usable && enabled, dt_s);
  if (usable) {
    if (parameters_.mode == DragMode::kSeparable) {
      aim_separable(drag, gain, out);
    } else {
      aim_coupled(drag, gain, out);
    }
  }
  out.gain = aimed_gain_;
  out.damping_limited = aim_limited_ && out.authority > 0.0;
  if (out.authority == 0.0) {
    force_ = {};  // what comes next starts from nothing
    if (!usable) aim_ = {};
    return out;
  }
  smooth(dt_s);
  if (!core::all_finite(v, parameters_.joint_count)) return out;
  if (parameters_.mode == DragMode::kSeparable) {
    render_separable(v, out);
  } else {
    render_coupled(v, out);
  }
  return out;
}

// Each joint to its own limit: a light wrist does not take the percept from the shoulder.
void PerceptRenderer::aim_separable(const DragCoefficients& drag, double gain, RenderedPercept&) noexcept {
  aimed_gain_ = gain;
  aim_limited_ = false;
  for (std::size_t j = 0; j < parameters_.joint_count; ++j) {
    const double limit = parameters_.damping_limit_Nms_per_rad[j];
    const double plus = gain * std::max(0.0, drag.plus[j]);
    const double minus = gain * std::max(0.0, drag.minus[j]);
    aim_.plus[j] = std::min(plus, limit);
    aim_.minus[j] = std::min(minus, limit);
    const double greatest = std::max(plus, minus);
    if (greatest > limit) {
      aim_limited_ = true;
      aimed_gain_ = std::min(aimed_gain_, gain * limit / greatest);
    }
  }
}

// The matrix as a whole, or it would not stay positive semi-definite. In coordinates scaled by √limit the
// greatest eigenvalue must not exceed 1; the greatest row sum of magnitudes bounds it (Gershgorin).
void PerceptRenderer::aim_coupled(const DragCoefficients& drag, double gain, RenderedPercept&) noexcept {
  const std::size_t count = parameters_.joint_count;
  double bound = 0.0;
  for (std::size_t i = 0; i < count; ++i) {
    double row = 0.0;
    for (std::size_t j = 0; j < count; ++j) {
      const auto& limit = parameters_.damping_limit_Nms_per_rad;
      if (entry(drag, i, j) == 0.0) continue;  // 0 ÷ 0 for a joint that may not be damped at all
      row += gain * std::abs(entry(drag, i, j)) / std::sqrt(limit[i] * limit[j]);
    }
    bound = std::max(bound, row);
  }
  aim_limited_ = bound > 1.0;
  aimed_gain_ = aim_limited_ ? gain / bound : gain;
  for (std::size_t k = 0; k < count * (count + 1) / 2; ++k) aim_.coupled[k] = aimed_gain_ * drag.coupled[k];
}

void PerceptRenderer::smooth(double dt_s) noexcept {
  const double share = dt_s / (dt_s + parameters_.smoothing_s);
  const std::size_t count = parameters_.joint_count;
  for (std::size_t j = 0; j < count; ++j) {
    force_.plus[j] += share * (aim_.plus[j] - force_.plus[j]);
    force_.minus[j] += share * (aim_.minus[j] - force_.minus[j]);
  }
  if (parameters_.mode == DragMode::kSeparable) return;
  for (std::size_t k = 0; k < count * (count + 1) / 2; ++k)
    force_.coupled[k] += share * (aim_.coupled[k] - force_.coupled[k]);
}

void PerceptRenderer::render_separable(const core::JointArray& v, RenderedPercept& out) const noexcept {
  for (std::size_t j = 0; j < parameters_.joint_count; ++j) {
    const double torque = -out.authority * (v[j] > 0.0 ? force_.plus[j] : force_.minus[j]) * v[j];
    const double cap = parameters_.torque_cap_Nm[j];
    out.torque_limited = out.torque_limited || std::abs(torque) > cap;
    out.torque_Nm[j] = std::clamp(torque, -cap, cap);
  }
}

// One factor for all joints: clamping them one by one could turn drag into push on another joint.
void PerceptRenderer::render_coupled(const core::JointArray& v, RenderedPercept& out) const noexcept {
  const std::size_t count = parameters_.joint_count;
  double scale = 1.0, power_W = 0.0;
  for (std::size_t i = 0; i < count; ++i) {
    double torque = 0.0;
    for (std::size_t j = 0; j < count; ++j) torque -= out.authority * entry(force_, i, j) * v[j];
    out.torque_Nm[i] = torque;
    power_W += torque * v[i];
    const double cap = parameters_.torque_cap_Nm[i];
    if (std::abs(torque) > cap) scale = std::min(scale, cap / std::abs(torque));
  }
  if (!(power_W <= 0.0))
    scale = 0.0;  // not positive semi-definite after all: render nothing rather than push
  out.torque_limited = scale < 1.0;
  for (std::size_t i = 0; i < count; ++i) {
    out.torque_Nm[i] = scale > 0.0 ? scale * out.torque_Nm[i] : 0.0;  // a product may have overflowed
  }
}

}  // namespace phantom::teleop

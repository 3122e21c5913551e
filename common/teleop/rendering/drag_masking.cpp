#include "common/teleop/rendering/drag_masking.hpp"

#include <algorithm>
#include <cmath>

namespace phantom::teleop {

void MaskingMonitor::step(const core::JointArray& drag_Nm, const core::JointArray& feedback_Nm,
                          double dt_s) noexcept {
  const MaskingParameters& p = parameters_;
  const auto weight_of = [dt_s](double time_s) { return time_s > 0.0 ? std::min(1.0, dt_s / time_s) : 1.0; };
  bool dragged = false, apart = false;
  for (std::size_t j = 0; j < p.joint_count; ++j) {
    double& background_Nm = background_Nm_[j];
    background_Nm += (started_ ? weight_of(p.adaptation_s) : 1.0) * (feedback_Nm[j] - background_Nm);
    const double drag = std::abs(drag_Nm[j]);
    if (drag <= p.drag_floor_Nm[j]) continue;
    dragged = true;
    apart |= drag >= p.weber_fraction * std::abs(background_Nm) + std::abs(feedback_Nm[j] - background_Nm);
  }
  started_ = true;
  if (!dragged) return;
  share_ += weight_of(p.judging_s) * ((apart ? 0.0 : 1.0) - share_);
  masked_ = share_ >= (masked_ ? kHeard : kMasked);
}

void MaskingMonitor::reset() noexcept {
  background_Nm_ = {};
  started_ = masked_ = false;
  share_ = 0.0;
}

}  // namespace phantom::teleop

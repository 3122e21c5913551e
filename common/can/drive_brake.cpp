// The holding brake of a drive, which the drive itself opens and closes.
#include <cmath>

#include "common/can/drive.hpp"

namespace phantom::can {

// Returns whether the drive has power and its brake has had time to open.
bool Drive::brake_is_open(core::Nanoseconds now_ns) noexcept {
  if (report_.power != PowerState::kOperationEnabled) powered_ns_ = -1;
  if (report_.power == PowerState::kOperationEnabled && powered_ns_ < 0) powered_ns_ = now_ns;
  if (powered_ns_ < 0 || (brake_ && core::seconds(now_ns - powered_ns_) < brake_->release_s)) return false;
  powered_counts_ = report_.position_counts;
  report_.unmoved = brake_.has_value();
  strained_ns_ = -1;
  return true;
}

// Returns whether the joint has stood still under its full torque since it got power. Once it has moved, a
// joint that is held fast is so by what it touches.
bool Drive::brake_seems_closed(core::Nanoseconds now_ns) noexcept {
  const double moved = std::abs(static_cast<double>(report_.position_counts) - powered_counts_);
  report_.unmoved = report_.unmoved && moved < moved_counts_;
  if (!report_.unmoved || std::abs(report_.torque_mille) < full_mille_) {
    strained_ns_ = -1;
    return false;
  }
  if (strained_ns_ < 0) strained_ns_ = now_ns;
  return core::seconds(now_ns - strained_ns_) > timing_.state_timeout_s;
}

double Drive::enable_timeout_s() const noexcept {
  return timing_.state_timeout_s + (brake_ ? brake_->engage_s + brake_->release_s : 0.0);
}

}  // namespace phantom::can

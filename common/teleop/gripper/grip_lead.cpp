#include "common/teleop/gripper/grip_lead.hpp"

#include <algorithm>
#include <cmath>

namespace phantom::teleop {

bool GripLead::is_own(double width_m, core::Nanoseconds now_ns) const noexcept {
  constexpr double kSame_m = 1e-6;
  const auto same = [&](double own_m) { return std::abs(own_m - width_m) <= kSame_m; };
  if (now_ns - requested_ns_ > kOnItsWay_ns) return same(last_m());
  const std::size_t known = std::min(count_, requested_m_.size());
  return std::any_of(requested_m_.begin(), requested_m_.begin() + static_cast<std::ptrdiff_t>(known), same);
}

std::optional<double> GripLead::step(double opening, bool may, const Gripper& gripper,
                                     core::Nanoseconds now_ns) noexcept {
  const bool has_grip = opening >= 0.0 && opening <= 1.0;  // false if it is not finite, too
  const GripperStatus& now = gripper.status;
  if (!has_grip || !may || !(gripper.widest_m > 0.0) || !now.sense.follows || now.sense.fault) {
    leads_ = false;
    before_m_.reset();
    return std::nullopt;
  }
  const double step_m = kStep * gripper.widest_m, in_force_m = now.requested_width_m;
  double width_m = opening * gripper.widest_m;
  if (width_m <= step_m) width_m = 0.0;
  if (width_m >= gripper.widest_m - step_m) width_m = gripper.widest_m;
  if (leads_ && !is_own(in_force_m, now_ns)) {
    leads_ = false;
    before_m_.reset();
  }
  if (!leads_) {
    const bool meets = std::abs(width_m - in_force_m) <= step_m;
    const bool passes = before_m_ && (*before_m_ - in_force_m) * (width_m - in_force_m) < 0.0;
    before_m_ = width_m;
    if (!meets && !passes) return std::nullopt;
    leads_ = true;
    count_ = 0;
    note(in_force_m);
  }
  const bool at_end = width_m == 0.0 || width_m == gripper.widest_m;
  const double way_m = std::abs(width_m - last_m());
  if (now_ns - requested_ns_ < kEvery_ns || (at_end ? way_m == 0.0 : way_m < step_m)) return std::nullopt;
  requested_ns_ = now_ns;
  note(width_m);
  return width_m;
}

}  // namespace phantom::teleop

#include "common/runtime/servo/servo_check.hpp"

#include <cmath>

#include "common/core/text.hpp"

namespace phantom::runtime {

std::string oscillation_reason(const teleop::JointServoGains& gains, double inertia, double period_s,
                               double delay_periods) {
  const double delay_s = period_s * delay_periods;
  const double most_s = teleop::kUsableShareOfDelayMargin * teleop::delay_margin_s(gains, inertia);
  if (gains.k_v <= 0.0 || delay_s <= most_s) return "";
  return core::formatted(
      "swing at rate_Hz %.3g: %.3g ms pass from a position to its torque, %.3g ms may; allowed: softer loops, "
      "or rate_Hz from %.3g",
      1.0 / period_s, 1e3 * delay_s, 1e3 * most_s, std::ceil(delay_s / most_s / period_s));
}

}  // namespace phantom::runtime

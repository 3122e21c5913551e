#include "common/runtime/servo_check.hpp"

#include <cmath>
#include <iomanip>
#include <sstream>

namespace phantom::runtime {

std::string oscillation_reason(const teleop::JointServoGains& gains, double inertia, double period_s,
                               double delay_periods) {
  const double delay_s = period_s * delay_periods;
  const double most_s = teleop::kUsableShareOfDelayMargin * teleop::delay_margin_s(gains, inertia);
  if (gains.k_v <= 0.0 || delay_s <= most_s) return "";
  std::ostringstream text;
  text << std::setprecision(3) << "swing at rate_Hz " << 1.0 / period_s << ": " << 1e3 * delay_s
       << " ms pass from a position to its torque, " << 1e3 * most_s
       << " ms may; allowed: softer loops, or rate_Hz from " << std::ceil(delay_s / most_s / period_s);
  return text.str();
}

}  // namespace phantom::runtime

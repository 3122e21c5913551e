#include "common/runtime/servo_check.hpp"

#include <cmath>
#include <iomanip>
#include <sstream>

namespace phantom::runtime {
namespace {

// With at most half of the delay margin, the loop is still well damped.
constexpr double kDelayShare = 0.5;

}  // namespace

std::string why_it_swings(const teleop::JointServoGains& gains, double inertia, double period_s,
                          double delay_periods) {
  const double delay_s = period_s * delay_periods;
  const double most_s = kDelayShare * teleop::delay_margin_s(gains, inertia);
  if (gains.k_v <= 0.0 || delay_s <= most_s) return "";
  std::ostringstream text;
  text << std::setprecision(3) << "swing at rate_Hz " << 1.0 / period_s << ": " << 1e3 * delay_s
       << " ms pass from a position to its torque, " << 1e3 * most_s
       << " ms may; allowed: softer loops, or rate_Hz from " << std::ceil(delay_s / most_s / period_s);
  return text.str();
}

}  // namespace phantom::runtime

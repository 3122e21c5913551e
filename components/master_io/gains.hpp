#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "components/master_io/master_io.hpp"

namespace phantom::master_io {

/// Rules for commands that set gains and law.
struct GainRules {
  std::vector<std::string> joints;  ///< their names
  teleop::FeedbackLimits limits;
  double contact_ratio = 1.0;  ///< 1/A in contact ÷ 1/A out of it
};

GainRules gain_rules(const Config& config, const robot::SerialArm& arm);

/// Addresses all joints instead of one.
inline constexpr std::int32_t kAllJoints = -1;

/// Each function changes `settings` and returns "", or leaves them unchanged and returns why, with what is
/// allowed. `joint`: from 0, or kAllJoints. The functions allocate memory; not for the servo thread.
std::string set_percept_gain(double gain, std::int32_t joint, const GainRules& rules, Settings& settings);
/// Refuses gains that are not stable with `round_trip_s`, the delay in force, and names the joint with the
/// lowest limit.
std::string set_feedback_gain(double inverse_a, std::int32_t joint, const GainRules& rules,
                              double round_trip_s, Settings& settings);
/// `law` is the number of a BilateralLaw. 1/A becomes the value configured for the law.
std::string set_law(double law, Settings& settings);

}  // namespace phantom::master_io

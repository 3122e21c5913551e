#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "components/master_io/master_io.hpp"

namespace phantom::master_io {

/// What commands that set gains and law are held against.
struct GainRules {
  std::vector<std::string> joints;  ///< their names
  teleop::FeedbackLimits limits;
  double contact_ratio = 1.0;  ///< 1/A in contact ÷ 1/A out of it
};

GainRules gain_rules(const Config& config, const robot::SerialArm& arm);

/// "Of all joints."
inline constexpr std::int32_t kAllJoints = -1;

/// Each changes `settings` and returns "", or leaves them as they are and returns why, with what is allowed.
/// `joint`: from 0, or kAllJoints. Allocate; not for the servo thread.
std::string set_percept_gain(double gain, std::int32_t joint, const GainRules& rules, Settings& settings);
/// `round_trip_s`: the delay in force. Refuses what is not stable with it, with the joint that bears least.
std::string set_feedback_gain(double inverse_a, std::int32_t joint, const GainRules& rules,
                              double round_trip_s, Settings& settings);
/// `law`: number of a BilateralLaw. 1/A becomes the law's own.
std::string set_law(double law, Settings& settings);

}  // namespace phantom::master_io

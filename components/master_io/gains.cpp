#include "components/master_io/gains.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>

#include "common/runtime/drives_config.hpp"

namespace phantom::master_io {
namespace {

constexpr double kGreatestPerceptGain = 1000.0, kGreatestInverseA = 10.0;

std::string wrong_joint(std::int32_t joint, const GainRules& rules) {
  if (joint == kAllJoints || (joint >= 0 && static_cast<std::size_t>(joint) < rules.joints.size())) return "";
  return fmt::format("there is no joint {}; allowed: 0 to {}, or -1 for all", joint,
                     static_cast<int>(rules.joints.size()) - 1);
}

void set(core::JointArray& values, std::int32_t joint, double value) {
  if (joint == kAllJoints) {
    values.fill(value);
  } else {
    values[static_cast<std::size_t>(joint)] = value;
  }
}

}  // namespace

GainRules gain_rules(const Config& config, const robot::SerialArm& arm) {
  return {runtime::joint_names(arm), config.feedback.limits, config.feedback.contact_gain_ratio};
}

std::string set_percept_gain(double gain, std::int32_t joint, const GainRules& rules, Settings& settings) {
  if (!(gain >= 0.0 && gain <= kGreatestPerceptGain))
    return fmt::format("G {} cannot be; allowed: 0 to {}", gain, kGreatestPerceptGain);
  if (std::string why = wrong_joint(joint, rules); !why.empty()) return why;
  set(settings.percept_gain, joint, gain);
  return "";
}

std::string set_feedback_gain(double inverse_a, std::int32_t joint, const GainRules& rules,
                              double round_trip_s, Settings& settings) {
  if (!(inverse_a >= 0.0 && inverse_a <= kGreatestInverseA))
    return fmt::format("1/A {} cannot be; allowed: 0 to {}", inverse_a, kGreatestInverseA);
  if (std::string why = wrong_joint(joint, rules); !why.empty()) return why;
  core::JointArray asked{};  // joints that are not addressed get 0, which is always stable
  set(asked, joint, inverse_a);
  std::string why = teleop::why_feedback_is_unstable(rules.limits, settings.law, asked, rules.contact_ratio,
                                                     round_trip_s, rules.joints);
  if (why.empty()) set(settings.feedback_gain, joint, inverse_a);
  return why;
}

std::string set_law(double law, Settings& settings) {
  if (!(law >= 0.0 && law < teleop::kBilateralLaws && law == std::floor(law)))
    return fmt::format("law {} is not known; allowed: 0 (pf) to {} (peff)", law, teleop::kBilateralLaws - 1);
  settings.law = static_cast<teleop::BilateralLaw>(law);
  settings.feedback_gain = teleop::everywhere(teleop::kLawsOwnGain);
  return "";
}

}  // namespace phantom::master_io

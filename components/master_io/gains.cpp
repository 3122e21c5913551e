#include "components/master_io/gains.hpp"

#include <spdlog/fmt/fmt.h>

#include "common/runtime/configuration/drives_config.hpp"
#include "common/teleop/rendering/percept_set.hpp"

namespace phantom::master_io {
namespace {

using teleop::CommandKind;

constexpr std::int32_t kAllJoints = -1;

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

std::string why_not_stable(const messages::OperatorCommand& command, const GainRules& rules,
                           double round_trip_s, const Settings& settings) {
  core::JointArray asked{};  // joints that are not addressed get 0, which is always stable
  set(asked, command.joint, command.value);
  return teleop::why_feedback_is_unstable(rules.limits, settings.law, asked, rules.contact_ratio,
                                          round_trip_s, rules.joints);
}

}  // namespace

GainRules gain_rules(const Config& config, const robot::SerialArm& arm) {
  return {runtime::joint_names(arm), config.feedback.limits, config.feedback.contact_gain_ratio};
}

Settings initial_settings(const Config& config) {
  Settings settings;
  settings.percept_gain = config.percept_gain;
  settings.law = config.feedback.law;
  settings.percepts = teleop::percepts_of(config.percepts, settings.law);
  return settings;
}

int percepts_by_key(const teleop::PerceptChoice& now, PerceptKey key) noexcept {
  if (key == PerceptKey::kLaw) return teleop::kAutomaticPercepts;
  const int number = (now.drag ? 1 : 0) + (now.tone ? 2 : 0) + (now.views ? 4 : 0);
  return number ^ 1 << static_cast<int>(key);
}

core::Status apply_setting(const messages::OperatorCommand& command, const GainRules& rules,
                           double round_trip_s, Settings& settings) {
  const bool percept_gain = command.kind == CommandKind::kSetPerceptGain;
  const bool feedback_gain = command.kind == CommandKind::kSetFeedbackGain;
  std::string why = teleop::value_refusal(command.kind, command.value);
  if (why.empty() && (percept_gain || feedback_gain)) why = wrong_joint(command.joint, rules);
  if (why.empty() && feedback_gain) why = why_not_stable(command, rules, round_trip_s, settings);
  if (!why.empty()) return core::Status::invalid_argument(why);
  if (percept_gain) {
    set(settings.percept_gain, command.joint, command.value);
  } else if (feedback_gain) {
    set(settings.feedback_gain, command.joint, command.value);
  } else if (command.kind == CommandKind::kEnablePercept) {
    settings.percepts.drag = command.value == 1.0;
  } else if (command.kind == CommandKind::kSetPercepts) {
    settings.percepts = teleop::percepts_of(static_cast<int>(command.value), settings.law);
  } else if (command.kind == CommandKind::kSetLaw) {
    settings.law = static_cast<teleop::BilateralLaw>(command.value);
    settings.feedback_gain = teleop::everywhere(teleop::kLawsOwnGain);
    if (settings.percepts.automatic) settings.percepts = teleop::percepts_beside(settings.law);
  } else {
    return core::Status::invalid_argument("this command is not for master_io");
  }
  return core::Status::ok();
}

}  // namespace phantom::master_io

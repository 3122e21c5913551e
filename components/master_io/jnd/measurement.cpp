#include "components/master_io/jnd/measurement.hpp"

#include <algorithm>
#include <cmath>

#include "common/core/text.hpp"

namespace phantom::master_io {
namespace {

core::Status failed(std::string message) {
  return {core::ErrorCode::kFailedPrecondition, std::move(message)};
}

/// Lets the hand move in the drag of that gain; returns the damping coefficient that it felt.
core::Expected<double> felt_with(const JndPlan& plan, double gain, ComparedDrag& drag) {
  if (const auto set = drag.set_gain(gain); !set) return set;
  FeltDrag felt(plan.interval);
  while (!felt.complete()) {
    const auto state = drag.next();
    if (!state) return state.status();
    felt.take(*state);
    if (felt.since_begin_s() > plan.patience_s)
      return failed(
          core::formatted("%s moved for %.1f s of %g s; allowed: at least %g s, faster than %g, "
                          "coupled and with drag on",
                          plan.joint_name.c_str(), felt.moved_s(), plan.patience_s, plan.interval.moving_s,
                          plan.interval.least_speed));
  }
  if (felt.limited_share() > plan.most_limited)
    return failed(core::formatted(
        "with G %g the drag on the hand was limited in %.0f %% of the motion (percept_limited: stability or a "
        "cap), so it was not G's; allowed: a smaller --gain, slower motion, or a place with less drag",
        gain, 100.0 * felt.limited_share()));
  if (!(felt.damping() > 0.0))
    return failed("no drag on " + plan.joint_name + "; allowed: a place in the fluid, where it is felt");
  return felt.damping();
}

/// Checks that the hand felt the difference that was asked for.
core::Status check_ratio(const JndPlan& plan, const percept::Comparison& comparison, double first,
                         double second) {
  const double wanted =
      comparison.greater_first ? 1.0 + comparison.fraction : 1.0 / (1.0 + comparison.fraction);
  if (std::abs(std::log(first / second / wanted)) <= std::log1p(plan.most_deviation))
    return core::Status::ok();
  return failed(core::formatted(
      "the drags on %s were felt as %.3g to %.3g %s, but their G are as %.3g to 1; allowed: a place where drag is "
      "alike all along the motion, and nobody else who sets G (another jnd, the operator's page)",
      plan.joint_name.c_str(), first, second, plan.unit.c_str(), wanted));
}

core::Expected<JndTrial> make_trial(const JndPlan& plan, int number, const percept::Comparison& comparison,
                                    ComparedDrag& drag, DragJudge& judge) {
  JndTrial trial{.comparison = comparison};
  const double greater = plan.reference_gain * (1.0 + comparison.fraction);
  judge.begin(number, 1);
  const auto first = felt_with(plan, comparison.greater_first ? greater : plan.reference_gain, drag);
  if (!first) return first.status();
  judge.begin(number, 2);
  const auto second = felt_with(plan, comparison.greater_first ? plan.reference_gain : greater, drag);
  if (!second) return second.status();
  if (const auto set = drag.set_gain(plan.reference_gain); !set) return set;
  if (const auto alike = check_ratio(plan, comparison, *first, *second); !alike) return alike;
  const auto answer = judge.calls_first_greater(*first, *second);
  if (!answer) return answer.status();
  trial.first = *first;
  trial.second = *second;
  trial.first_called_greater = *answer;
  return trial;
}

core::Expected<JndOutcome> make_trials(const JndPlan& plan, ComparedDrag& drag, DragJudge& judge) {
  percept::Staircase staircase(plan.staircase);
  JndOutcome outcome;
  while (const auto comparison = staircase.next()) {
    const auto trial =
        make_trial(plan, static_cast<int>(outcome.trials.size()) + 1, *comparison, drag, judge);
    if (!trial) return trial.status();
    staircase.answer(trial->first_called_greater, std::log(trial->first / trial->second));
    outcome.trials.push_back(*trial);
    outcome.reference += comparison->greater_first ? trial->second : trial->first;
  }
  outcome.reference /= static_cast<double>(outcome.trials.size());
  outcome.settled = staircase.settled();
  outcome.threshold = staircase.result();
  return outcome;
}

}  // namespace

core::Expected<JndOutcome> measure_jnd(const JndPlan& plan, ComparedDrag& drag, DragJudge& judge) {
  if (const auto checked = percept::check_staircase(plan.staircase); !checked) return checked;
  auto outcome = make_trials(plan, drag, judge);
  if (!outcome)
    if (const auto restored = drag.set_gain(plan.reference_gain); !restored)
      return failed(outcome.status().message() +
                    core::formatted("; and G is not back at %g: ", plan.reference_gain) + restored.message());
  return outcome;
}

}  // namespace phantom::master_io

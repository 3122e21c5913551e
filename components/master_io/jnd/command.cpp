#include "components/master_io/jnd/command.hpp"

#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "common/core/random.hpp"
#include "common/core/text.hpp"
#include "common/runtime/process/process.hpp"
#include "common/teleop/commands/operator_command.hpp"
#include "components/master_io/jnd/dds_adapter_gain.hpp"
#include "components/master_io/jnd/judges.hpp"

namespace phantom::master_io {
namespace {

constexpr double kSimulatedLapses = 0.02;
/// Greatest G that a joint may be given.
const double kMaxGain = teleop::rule_of(teleop::CommandKind::kSetPerceptGain).greatest;

/// Salt, so that a simulated observer's noise does not repeat the order of the intervals.
constexpr std::uint32_t kObserverSalt = 0x9E3779B9U;

std::unique_ptr<DragJudge> judge_for(const JndRequest& request, const JndPlan& plan, std::ostream& out) {
  if (!request.simulated_fraction) return std::make_unique<AskedPerson>(plan.joint_name, STDIN_FILENO, out);
  const double ln_noise = percept::ln_noise_of(
      *request.simulated_fraction, percept::tracked_share(request.right_to_descend), kSimulatedLapses);
  return std::make_unique<SimulatedJudge>(
      simulation::DragObserverParameters{ln_noise, kSimulatedLapses, plan.staircase.seed ^ kObserverSalt});
}

double percent(double fraction) { return 100.0 * fraction; }

}  // namespace

void add_options(runtime::Command command, JndRequest& request) {
  command.option("--joint", request.joint_name, "the joint whose drag is compared, by its name").required();
  command
      .option("--gain", request.gain,
              "reference G, the lesser drag of each comparison, and G of the joint afterwards; default: the "
              "joint's in the parameters")
      .between(1e-3, kMaxGain);
  command
      .option("--right", request.right_to_descend,
              "right answers in succession that make the difference smaller: 2 finds where 70.7 % are right, "
              "3 where 79.4 %")
      .between(2, 5);
  command.option("--reversals", request.reversals, "turns of direction after which it ends").between(4, 100);
  command.option("--most-trials", request.most_trials, "it ends after so many, with code 1")
      .between(10, 10000);
  command
      .option("--first-fraction", request.first_fraction, "first difference: greater drag ÷ lesser one − 1")
      .between(0.01, 4.0);
  command.option("--moving-s", request.moving_s, "how long the hand moves in each drag").between(0.2, 60.0);
  command.option("--patience-s", request.patience_s, "how long to wait for that").between(1.0, 3600.0);
  command
      .option("--simulated-operator", request.simulated_fraction,
              "a simulated observer of this Weber fraction answers, who feels what the master renders")
      .between(0.01, 4.0);
  command.option("--seed", request.seed,
                 "of the order of the drags, and of a simulated observer; default, 0: by chance");
  command.option("--json", request.json, "write outcome and trials to this file; -: to standard output");
  command.details(
      "The hand moves the joint in two drags, and says which was more viscous. An adaptive staircase (Levitt "
      "1971) chooses the next difference. At the end: the least noticeable change of drag as a share of it "
      "(Weber fraction), with its 95 % interval.\n"
      "The arm must be where drag is felt and alike all along the motion: in a medium that fills space "
      "(deploy/topologies/drag_bench.yaml), or along a face of an object. See docs/commissioning.md.\n"
      "Try: master_io jnd --deployment deploy/topologies/drag_bench.yaml --joint x --simulated-operator 0.2\n"
      "G of the joint is the reference afterwards. Killed by SIGKILL in a trial it leaves that trial's G: master_io "
      "command percept-gain sets it.\n"
      "Exit codes: 0 measured, 1 not measured, 2 wrong arguments, 3 no master heard.");
}

JndPlan plan_of(const JndRequest& request, const ArmModel& model, const Config& config) {
  JndPlan plan;
  const int joint = joint_index(model, request.joint_name);
  if (joint < 0) throw core::ConfigError("--joint: is empty; allowed: the name of a joint of the arm");
  plan.interval.joint = static_cast<std::size_t>(joint);
  plan.interval.moving_s = request.moving_s;
  plan.joint_name = request.joint_name;
  const bool slides = model.arm.joints()[plan.interval.joint].type == robot::JointType::kPrismatic;
  plan.unit = slides ? "N·s/m" : "N·m·s/rad";
  plan.reference_gain = request.gain.value_or(config.percept_gain[plan.interval.joint]);
  if (!(plan.reference_gain > 0.0))
    throw core::ConfigError("--gain: the joint's G in the parameters is 0; allowed: above 0");
  plan.patience_s = request.patience_s;
  plan.staircase.right_to_descend = request.right_to_descend;
  plan.staircase.reversals = request.reversals;
  plan.staircase.most_trials = request.most_trials;
  plan.staircase.first_fraction = request.first_fraction;
  const double most_fraction = kMaxGain / plan.reference_gain - 1.0;
  if (request.first_fraction > most_fraction)
    throw core::ConfigError(
        core::formatted("--gain %g with --first-fraction %g: the greater drag has G %g; allowed: at most %g",
                        plan.reference_gain, request.first_fraction,
                        plan.reference_gain * (1.0 + request.first_fraction), kMaxGain));
  plan.staircase.greatest_fraction = std::min(plan.staircase.greatest_fraction, most_fraction);
  const std::uint64_t seed = request.seed != 0 ? request.seed : core::random_number();
  plan.staircase.seed = static_cast<std::uint32_t>(seed ^ seed >> 32);
  return plan;
}

std::string text_of(const JndPlan& plan, const JndOutcome& outcome) {
  const auto& found = outcome.threshold;
  std::string text = core::formatted(
      "just noticeable difference of drag on %s: %.1f %% (95 %%: %.1f to %.1f %%), where %.1f %% of answers "
      "are right\n%d trials, %d reversals (their mean: %.1f %%); reference: G %g, %.3g %s\n",
      plan.joint_name.c_str(), percent(found.fraction), percent(found.lower), percent(found.upper),
      percent(found.share_right), found.trials, found.reversals, percent(found.mean_of_reversals),
      plan.reference_gain, outcome.reference, plan.unit.c_str());
  if (outcome.settled)
    return text + core::formatted("which layers differ by less: wva_server --check --weber-fraction %.3f\n",
                                  found.fraction);
  return text +
         core::formatted(
             "NOT SETTLED: %d of %d reversals, or answers as by chance; allowed: more --most-trials, a stronger drag\n",
             found.reversals, plan.staircase.reversals);
}

std::string json_of(const JndPlan& plan, const JndOutcome& outcome) {
  const auto& found = outcome.threshold;
  nlohmann::json trials = nlohmann::json::array();
  for (const JndTrial& trial : outcome.trials)
    trials.push_back({{"fraction", trial.comparison.fraction},
                      {"greater_first", trial.comparison.greater_first},
                      {"first_felt", trial.first},
                      {"second_felt", trial.second},
                      {"first_called_greater", trial.first_called_greater}});
  const nlohmann::json all{{"joint", plan.joint_name},
                           {"weber_fraction", found.fraction},
                           {"lower_95", found.lower},
                           {"upper_95", found.upper},
                           {"share_right", found.share_right},
                           {"mean_of_reversals", found.mean_of_reversals},
                           {"reversals", found.reversals},
                           {"settled", outcome.settled},
                           {"reference_gain", plan.reference_gain},
                           {"reference_felt", outcome.reference},
                           {"unit", plan.unit},
                           {"seed", plan.staircase.seed},
                           {"trials", trials}};
  return all.dump(2) + "\n";
}

int run_jnd(const JndRequest& request, const ArmModel& model, const Config& config,
            const core::NetworkOptions& network) {
  const JndPlan plan = plan_of(request, model, config);
  const bool json_only = request.json == "-";
  std::ofstream file;  // opened before the operator's quarter of an hour
  if (!json_only && !request.json.empty()) file.open(request.json);
  if (!file) throw core::ConfigError("--json: " + request.json.string() + ": cannot be written");
  std::ostream& print = json_only ? std::cerr : std::cout;
  const auto judge = judge_for(request, plan, print);
  RunningDrag drag(network, messages::bounds_of(model.arm, model.identity),
                   static_cast<int>(plan.interval.joint));
  if (const auto heard = drag.next(); !heard) {
    print << heard.status().message() << '\n';
    return heard.status().code() == core::ErrorCode::kUnavailable ? runtime::kExitMissing
                                                                  : runtime::kExitFailed;
  }
  const auto outcome = measure_jnd(plan, drag, *judge);
  if (!outcome) {
    print << "not measured: " << outcome.status().message() << '\n';
    return runtime::kExitFailed;
  }
  print << text_of(plan, *outcome) << std::flush;
  if (json_only) std::cout << json_of(plan, *outcome) << std::flush;
  if (file.is_open() && !(file << json_of(plan, *outcome)).flush())
    throw std::runtime_error(request.json.string() + ": cannot be written");
  return outcome->settled ? runtime::kExitDone : runtime::kExitFailed;
}

}  // namespace phantom::master_io

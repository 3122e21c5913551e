#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "common/core/network.hpp"
#include "common/runtime/process/command_line.hpp"
#include "components/master_io/config.hpp"
#include "components/master_io/jnd/measurement.hpp"
#include "components/master_io/session.hpp"

namespace phantom::master_io {

/// Arguments of `master_io jnd`, which measures an operator's just noticeable difference of drag on the
/// running master.
struct JndRequest {
  std::string joint_name;
  std::optional<double> gain;  ///< none: the joint's in the parameters
  int right_to_descend = 3, reversals = 12, most_trials = 200;
  double first_fraction = 1.0;
  double moving_s = 2.0, patience_s = 60.0;
  std::optional<double> simulated_fraction;  ///< Weber fraction of a simulated observer; none: a person
  std::uint64_t seed = 0;                    ///< 0: by chance
  std::filesystem::path json;                ///< "-": standard output
};

/// Declares the command's options.
void add_options(runtime::Command command, JndRequest& request);

/// Returns the plan of a measurement. Throws ConfigError.
JndPlan plan_of(const JndRequest& request, const ArmModel& model, const Config& config);

/// Returns the outcome for a person, and as JSON.
std::string text_of(const JndPlan& plan, const JndOutcome& outcome);
std::string json_of(const JndPlan& plan, const JndOutcome& outcome);

/// Runs the command: asks a person at the terminal, or a simulated observer. Returns the exit code: done;
/// failed if the measurement could not be made or did not settle; missing if no master is heard. Throws
/// ConfigError, dds::DdsError.
int run_jnd(const JndRequest& request, const ArmModel& model, const Config& config,
            const core::NetworkOptions& network);

}  // namespace phantom::master_io

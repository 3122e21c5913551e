#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "common/runtime/process/command_line.hpp"
#include "components/phantom_sensing/config.hpp"
#include "components/phantom_sensing/contact_register.hpp"

namespace phantom::phantom_sensing {

/// Arguments of `phantom_sensing replay`, which runs the component's own step on a recording instead of on
/// DDS samples.
struct ReplayRequest {
  std::vector<std::filesystem::path> recordings;  ///< the files of one series, or a single file
  std::filesystem::path cell;
  std::string arm;  ///< empty: the configuration's
};

/// Counts how many recorded samples of a topic the step reproduced.
struct ReplayedTopic {
  std::uint64_t equal = 0;  ///< reproduced bit for bit
  std::uint64_t different = 0;
  std::uint64_t without_inputs = 0;  ///< not replayed: their slave_state or workspace is not in the recording
};

struct ReplayReport {
  ReplayedTopic drag_field, percept, interest_points;
  std::vector<std::string> differences;  ///< descriptions of the first differences
  /// Returns whether the recording has samples of drag_field and of percept and all of them were reproduced.
  bool ok() const {
    return drag_field.equal > 0 && percept.equal > 0 && drag_field.different == 0 && percept.different == 0;
  }
};

/// Runs the step on the recorded slave_state, workspace and contacts, in the order of ticks that the recorded
/// drag_field gives, and compares all bytes of its outputs with the recorded ones. What the running component
/// measures (the age of the state, the time of a tick, stamps, the percept's condition) is taken from the
/// recording. `contacts` holds the contacts that the cell allows. interest_points may differ at first where
/// the recording began during an alert. Throws MissingError for files that do not exist and ConfigError for
/// files that are no recordings.
ReplayReport replay_recording(const std::vector<std::filesystem::path>& files, const PhantomModel& model,
                              const PerceptSettings& settings, ContactRegister contacts);

void add_options(runtime::Command app, ReplayRequest& request);
/// Runs the command and prints the comparison. Returns the exit code, 1 if something differs. Throws
/// ConfigError and MissingError.
int run_replay(const ReplayRequest& request, Config config);

}  // namespace phantom::phantom_sensing

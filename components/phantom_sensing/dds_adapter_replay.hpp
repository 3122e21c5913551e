#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "common/runtime/command_line.hpp"
#include "components/phantom_sensing/config.hpp"
#include "components/phantom_sensing/contact_register.hpp"

namespace phantom::phantom_sensing {

/// `phantom_sensing replay`: the same step as in the running component, fed from a recording instead of from
/// DDS.
struct ReplayRequest {
  std::vector<std::filesystem::path> recordings;  ///< of one series, or one file
  std::filesystem::path cell;
  std::string arm;  ///< empty: the configuration's
};

/// How many recorded samples of a topic the step made again.
struct ReplayedTopic {
  std::uint64_t equal = 0;  ///< bit for bit
  std::uint64_t different = 0;
  std::uint64_t without_inputs = 0;  ///< their slave_state or workspace is not in the recording
};

struct ReplayReport {
  ReplayedTopic drag_field, percept, interest_points;
  std::vector<std::string> differences;  ///< the first ones, in words
  /// Whether drag_field and percept came out as recorded, and there were some.
  bool ok() const {
    return drag_field.equal > 0 && percept.equal > 0 && drag_field.different == 0 && percept.different == 0;
  }
};

/// Feeds the recorded slave_state, workspace and contacts through the step, tick by tick as the recorded
/// drag_field names them, and holds what comes out against what was recorded: all bytes. What the running
/// component measures (the age of the state, the time of a tick, stamps, what the workspace rests on) is
/// taken from the recording. `contacts` holds the contacts that the cell allows. interest_points may differ
/// at first where the recording began during an alert. Throws MissingError and ConfigError for files that are
/// not there or no recordings.
ReplayReport replay_recording(const std::vector<std::filesystem::path>& files, const PhantomModel& model,
                              const PerceptSettings& settings, ContactRegister contacts);

void add_options(runtime::Command app, ReplayRequest& request);
/// The whole command: prints what was found. Returns the exit code, 1 if something differs; throws
/// ConfigError and MissingError.
int run_replay(const ReplayRequest& request, Config config);

}  // namespace phantom::phantom_sensing

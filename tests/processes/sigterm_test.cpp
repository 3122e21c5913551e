// SIGTERM at any moment, also while a process starts, ends it within a second of its own time: time in which
// it was ready to run and the host ran something else does not count (running_process.hpp), time in which it
// waits or computes does. The quick form has three moments: at once, in the start, and after it; the long one
// (thorough.hpp) has one every 0.2 s, or as PHANTOM_SIGTERM_STEP_MS says.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <iostream>

#include "common/core/clock.hpp"
#include "tests/processes/running_process.hpp"
#include "tests/support/files.hpp"
#include "tests/support/own_domain.hpp"
#include "tests/support/thorough.hpp"

namespace phantom::processes {
namespace {

constexpr double kLimit_s = 1.0, kTried_s = 2.6;

struct Executable {
  const char* label;
  const char* name;
  std::vector<std::string> arguments;
};

// Times after the start at which the signal comes.
std::vector<double> moments_s() {
  const char* given = std::getenv("PHANTOM_SIGTERM_STEP_MS");
  if (given == nullptr && !test::thorough()) return {0.0, 0.3, 0.9};
  const double step_s = given != nullptr ? 1e-3 * std::atof(given) : 0.2;
  std::vector<double> moments;
  for (double moment_s = 0.0; moment_s < kTried_s; moment_s += step_s) moments.push_back(moment_s);
  return moments;
}

class Sigterm : public testing::TestWithParam<Executable> {
 protected:
  RunningProcess::Options options() const {
    std::vector<std::string> arguments{"--deployment", write_topology(folder_).string(), "--domain",
                                       std::to_string(test::own_domain())};
    const std::string folder = folder_.string(), own = std::to_string(getpid());
    for (std::string argument : GetParam().arguments) {
      if (argument == "FOLDER") argument = folder;
      if (argument == "BUS") argument = "user:sigterm_" + own;
      if (argument == "VIEWER") argument = (folder_ / "synthetic_viewer.yaml").string();
      arguments.push_back(argument);
    }
    return {.arguments = arguments};
  }
  std::filesystem::path folder_ = test::new_folder();
};

// Tries wva_server: a stop is requested while activating
TEST_P(Sigterm, EndsItWithinASecondWheneverItComes) {
  double worst_s = 0.0, worst_wall_s = 0.0;
  int tried = 0;
  for (const double moment_s : moments_s()) {
    ++tried;
    RunningProcess process(GetParam().name, options(), folder_);
    const auto due_ns = core::monotonic_ns() + core::from_seconds(moment_s);
    while (core::monotonic_ns() < due_ns) usleep(1'000);
    ASSERT_TRUE(process.running()) << "it ended by itself: " << process.log();
    const Duration took = process.end(SIGTERM);
    worst_s = std::max(worst_s, took.own_s());
    worst_wall_s = std::max(worst_wall_s, took.wall_s);
    EXPECT_LE(took.own_s(), kLimit_s)
        << "SIGTERM " << moment_s << " s after its start; of " << took.wall_s << " s\n"
        << process.log();
    // Before main() the signal's own action ends it.
    EXPECT_THAT(process.exit_code(), testing::AnyOf(0, 128 + SIGTERM)) << process.log();
  }
  std::cout << GetParam().label << ": " << tried << " moments, longest " << worst_s << " s of its own, "
            << worst_wall_s << " s in all\n";
}

INSTANTIATE_TEST_SUITE_P(
    Executables, Sigterm,
    testing::Values(Executable{"master_io", "master_io", {}}, Executable{"slave_io", "slave_io", {}},
                    Executable{"phantom_sensing", "phantom_sensing", {}},
                    Executable{"wva_server", "wva_server", {}},
                    Executable{"workspace_camera", "workspace_camera", {}},
                    Executable{"audio_percept", "audio_percept", {}},
                    Executable{"synthetic_viewer", "synthetic_viewer", {"--config", "VIEWER"}},
                    Executable{"dds_recorder", "dds_recorder", {"record", "--folder", "FOLDER"}},
                    Executable{"simulated_drive", "simulated_drive", {"--bus", "BUS"}},
                    Executable{"dds_spy", "dds_spy", {}},
                    Executable{"phantom_session", "phantom_session", {"--report-dir", "FOLDER"}}),
    [](const auto& tested) { return std::string(tested.param.label); });

}  // namespace
}  // namespace phantom::processes

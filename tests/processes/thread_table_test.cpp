// Every thread of running processes against the scheme of core/thread_place.hpp, which docs/threads.md shows.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <pthread.h>
#include <unistd.h>

#include <algorithm>
#include <optional>
#include <set>
#include <sstream>
#include <string_view>
#include <thread>

#include "common/core/clock.hpp"
#include "common/core/thread_config.hpp"
#include "tests/processes/running_process.hpp"
#include "tests/support/files.hpp"
#include "tests/support/own_domain.hpp"

namespace phantom::processes {
namespace {

bool may_be_real_time() {
  bool may = false;
  std::thread([&] {
    may = core::apply_thread_config(core::ThreadRole::kServo, core::kServoPriority).empty();
  }).join();
  return may;
}

struct Expected {
  const char* component;
  core::ThreadRole main;             // kMain: not in the haptic path; else its threads of DDS stand high, too
  std::vector<const char*> threads;  // that must be there

  bool haptic() const { return main != core::ThreadRole::kMain; }
};

class ThreadTable : public testing::TestWithParam<Expected> {
 protected:
  std::unique_ptr<RunningProcess> start(bool real_time) {
    RunningProcess::Options options{.real_time = real_time};
    options.arguments = {"--deployment", write_topology(folder_).string(), "--domain",
                         std::to_string(test::own_domain())};
    if (GetParam().main == core::ThreadRole::kDrives)
      options.arguments.insert(options.arguments.end(),
                               {"--bus", "user:thread_table_" + std::to_string(getpid())});
    return std::make_unique<RunningProcess>(GetParam().component, options, folder_);
  }
  // Until it has all the threads that it must have.
  bool whole(RunningProcess& process) const {
    const auto until_ns = core::monotonic_ns() + 60 * core::kNsPerSecond;
    while (core::monotonic_ns() < until_ns && process.running()) {
      const auto& needed = GetParam().threads;
      if (std::all_of(needed.begin(), needed.end(),
                      [&](const char* name) { return process.thread(name) != 0; }) &&
          main_has_its_place(process))
        return true;
      usleep(20'000);
    }
    return false;
  }
  // The main thread takes its place when all others have been started.
  bool main_has_its_place(RunningProcess& process) const {
    if (!GetParam().haptic() || !may_be_real_time()) return true;
    const auto threads = process.threads();
    return std::any_of(threads.begin(), threads.end(),
                       [&](const ThreadSeen& seen) { return seen.name == main_name() && seen.fifo; });
  }
  std::string main_name() const { return std::string(GetParam().component).substr(0, 15); }

  // The place of a thread that is seen; none: the table does not know it.
  std::optional<core::ThreadConfig> place(const ThreadSeen& seen) const {
    if (seen.name == main_name()) return core::place_of(GetParam().main);
    for (const core::ThreadConfig& known : core::thread_scheme()) {
      if (known.name[0] != '\0' && seen.name == known.name) return known;
    }
    return std::nullopt;
  }

  // OpenAL's thread that plays, and the one that PulseAudio's client keeps: made by whichever sound system is
  // there, with the priority that audio_percept lets them have.
  static bool of_the_sound_system(const ThreadSeen& seen) {
    return (seen.name == "alsoft-mixer" || seen.name == "threaded-ml") &&
           seen.priority <= core::fifo_priority(core::ThreadRole::kAudio, core::kServoPriority);
  }

  // Each thread that is not where the table says, a line each.
  std::string out_of_place(const RunningProcess& process) const {
    std::ostringstream problems;
    for (const ThreadSeen& seen : process.threads()) {
      const auto known = place(seen);
      if (!known && std::string_view(GetParam().component) == "audio_percept" && of_the_sound_system(seen))
        continue;
      if (!known) {
        problems << seen.name << " is not in the table (docs/threads.md)\n";
        continue;
      }
      const bool asks = GetParam().haptic() || known->role == core::ThreadRole::kAudio;
      const int priority = asks ? core::fifo_priority(known->role, core::kServoPriority) : 0;
      if (seen.priority != priority || seen.fifo != (priority > 0))
        problems << seen.name << (seen.fifo ? ": SCHED_FIFO " : ": ordinary, ") << seen.priority
                 << "; in the table " << priority << '\n';
    }
    return problems.str();
  }

  std::filesystem::path folder_ = test::new_folder();
};

TEST_P(ThreadTable, EveryThreadHasANameOfTheTableAndItsPriority) {
  if (!may_be_real_time()) GTEST_SKIP() << "without the right to real-time priority there is none to look at";
  const auto process = start(true);
  ASSERT_TRUE(whole(*process)) << process->log();
  // A thread takes its name and its priority one after the other.
  std::string problems;
  const auto until_ns = core::monotonic_ns() + 20 * core::kNsPerSecond;
  do {
    usleep(20'000);
    problems = out_of_place(*process);
  } while (!problems.empty() && core::monotonic_ns() < until_ns);
  EXPECT_EQ(problems, "");
}

TEST_P(ThreadTable, WithoutTheRightItSaysSoOnceAndRuns) {
  const auto process = start(false);
  ASSERT_TRUE(process->running());
  const auto until_ns = core::monotonic_ns() + 60 * core::kNsPerSecond;
  const auto all_there = [&] {
    const auto& needed = GetParam().threads;
    return std::all_of(needed.begin(), needed.end(),
                       [&](const char* name) { return process->thread(name) != 0; });
  };
  const bool asks = GetParam().haptic() || process->thread("audio") != 0 ||
                    GetParam().threads.front() == std::string("audio");
  const auto notices = [&] {
    const std::string log = process->log();
    int count = 0;
    for (auto at = log.find("no real-time priority"); at != std::string::npos;
         at = log.find("no real-time priority", at + 1))
      ++count;
    return count;
  };
  while (core::monotonic_ns() < until_ns && !(all_there() && notices() >= (asks ? 1 : 0))) usleep(20'000);
  ASSERT_TRUE(all_there()) << process->log();
  usleep(300'000);  // a second notice would come with the next status
  EXPECT_EQ(notices(), asks ? 1 : 0) << process->log();
  for (const ThreadSeen& seen : process->threads()) EXPECT_FALSE(seen.fifo) << seen.name;
  EXPECT_TRUE(process->running());
}

INSTANTIATE_TEST_SUITE_P(
    Processes, ThreadTable,
    testing::Values(Expected{"slave_io", core::ThreadRole::kControl, {"servo", "publisher", "dds", "output"}},
                    Expected{"master_io",
                             core::ThreadRole::kControl,
                             {"servo", "bare_loop", "publisher", "dds", "output"}},
                    Expected{"phantom_sensing",
                             core::ThreadRole::kControl,
                             {"sensing", "dds", "alerts", "workspace", "output"}},
                    Expected{"simulated_drive", core::ThreadRole::kDrives, {"can_bus", "output"}},
                    Expected{"wva_server", core::ThreadRole::kMain, {"dds", "output"}},
                    Expected{"workspace_camera", core::ThreadRole::kMain, {"dds", "output"}},
                    Expected{"audio_percept", core::ThreadRole::kMain, {"audio", "dds", "output"}}),
    [](const auto& tested) { return std::string(tested.param.component); });

}  // namespace
}  // namespace phantom::processes

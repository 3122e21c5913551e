// The viewer, however overloaded, never slows the haptic loop (4.2): the servo loops with and without it, in
// turn, in one run on one host, by the stamps that they put on their samples themselves. On a host that
// others keep busy it answers and stops all the same.
#include <gtest/gtest.h>
#include <httplib.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <sstream>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "common/core/clock.hpp"
#include "common/dds/endpoints/endpoint.hpp"
#include "tests/end_to_end/running_system.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/late_sleeper.hpp"

namespace phantom::end_to_end {
namespace {

constexpr double kWindow_s = 5.0;
constexpr int kRounds = 3;
constexpr double kThreadsOnTheWay = 10.0;

/// Time from one tick to the next, as the loop itself stamped them.
class Ticks {
 public:
  void take(const msg::Stamp& stamp) {
    const std::lock_guard lock(mutex_);
    if (stamp.sequence_number() == last_number_ + 1) {
      periods_s_.push_back(1e-9 * static_cast<double>(stamp.monotonic_ns() - last_ns_));
    }
    last_number_ = stamp.sequence_number();
    last_ns_ = stamp.monotonic_ns();
  }
  bool begun() const {
    const std::lock_guard lock(mutex_);
    return periods_s_.size() > 10;
  }
  /// Those since the last call, sorted.
  std::vector<double> collect() {
    const std::lock_guard lock(mutex_);
    std::vector<double> taken;
    taken.swap(periods_s_);
    std::sort(taken.begin(), taken.end());
    return taken;
  }

 private:
  mutable std::mutex mutex_;
  std::uint64_t last_number_ = 0;
  std::int64_t last_ns_ = 0;
  std::vector<double> periods_s_;
};

/// A viewer that is asked for far more than any host gives: large pictures, many samples, as fast as it can,
/// each view followed by itself recording it.
class OverloadedViewer {
 public:
  explicit OverloadedViewer(const RunningSystem& system) {
    const auto config = system.folder() / "overloaded.yaml";
    std::ofstream(config) << "frame_rate_hz: 120\n"
                             "jpeg_quality: 100\n"
                             "main_view: {width_px: 2560, height_px: 1440, samples: 8}\n"
                             "hit_view: {width_px: 1920, height_px: 1080, samples: 8}\n"
                             "recording: {at_start: main, rate_hz: 60, folder: " +
                                 system.folder().string() +
                                 "}\n"
                                 "page: {port: 0}\n";
    const std::vector<std::string> words{
        PHANTOM_BIN_DIR "/synthetic_viewer",     "--config",    config.string(), "--domain",
        std::to_string(system.network().domain), "--log-level", "warning"};
    process_.emplace(words, system.folder() / "overloaded.log");
  }
  ~OverloadedViewer() { process_->end(SIGTERM); }
  /// Processor time that it has used so far.
  double cpu_s() const {
    const std::string text = read_text("/proc/" + std::to_string(process_->pid()) + "/stat");
    std::istringstream fields(text.substr(std::min(text.size(), text.rfind(')') + 2)));
    std::string skipped;
    for (int i = 0; i < 11; ++i) fields >> skipped;
    double user = 0, kernel = 0;
    fields >> user >> kernel;
    return (user + kernel) / static_cast<double>(sysconf(_SC_CLK_TCK));
  }

 private:
  std::optional<test::Process> process_;
};

double quantile(const std::vector<double>& sorted, double share) {
  return sorted.empty() ? 0.0
                        : sorted[static_cast<std::size_t>(share * static_cast<double>(sorted.size() - 1))];
}
double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return quantile(values, 0.5);
}

void rest(double seconds) {
  const auto until = core::monotonic_ns() + core::from_seconds(seconds);
  eventually([until] { return core::monotonic_ns() >= until; }, 10 * seconds);
}

TEST(ViewerLoad, AnOverloadedViewerDoesNotSlowTheServoLoops) {
  RunningSystem system(0, "single_host", "synthetic_viewer");
  Ticks slave, master;
  dds::Participant participant("viewer_load_test", system.network());
  dds::Reader<msg::SlaveState> slaves(
      participant, dds::kSlaveState,
      [&](const msg::SlaveState& state, const dds::SampleInfo&) { slave.take(state.stamp()); });
  dds::Reader<msg::MasterState> masters(
      participant, dds::kMasterState,
      [&](const msg::MasterState& state, const dds::SampleInfo&) { master.take(state.stamp()); });
  ASSERT_TRUE(eventually([&] { return slave.begun() && master.begun(); }, 120)) << system.output();
  struct Figures {
    std::vector<double> p50, p99, slipped;
    void add(const std::vector<double>& periods_s) {
      p50.push_back(quantile(periods_s, 0.5));
      p99.push_back(quantile(periods_s, 0.99));
      const auto late = periods_s.end() - std::lower_bound(periods_s.begin(), periods_s.end(), 0.002);
      slipped.push_back(static_cast<double>(late) / static_cast<double>(periods_s.size()));
    }
  };
  Figures without, with;
  double viewer_cores = 0;
  for (int round = 0; round < kRounds; ++round) {
    for (Ticks* loop : {&slave, &master}) loop->collect();
    rest(kWindow_s);
    for (Ticks* loop : {&slave, &master}) {
      const auto periods = loop->collect();
      ASSERT_GT(periods.size(), 100U);
      without.add(periods);
    }
    const OverloadedViewer viewer(system);
    ASSERT_TRUE(eventually([&] { return viewer.cpu_s() > 2.0; }, 120)) << "the viewer does not work";
    for (Ticks* loop : {&slave, &master}) loop->collect();
    const double before_s = viewer.cpu_s();
    rest(kWindow_s);
    viewer_cores = std::max(viewer_cores, (viewer.cpu_s() - before_s) / kWindow_s);
    for (Ticks* loop : {&slave, &master}) {
      const auto periods = loop->collect();
      ASSERT_GT(periods.size(), 100U);
      with.add(periods);
    }
  }
  std::cout << "viewer: " << viewer_cores << " cores; servo loops without and with it: median period "
            << 1e3 * median(without.p50) << " / " << 1e3 * median(with.p50) << " ms, p99 "
            << 1e3 * median(without.p99) << " / " << 1e3 * median(with.p99) << " ms, beyond 2 ms "
            << 100 * median(without.slipped) << " / " << 100 * median(with.slipped) << " %\n";
  EXPECT_GT(viewer_cores, 0.2) << "it was no load at all";
  // Judged generously: other work on the host comes and goes between the windows.
  EXPECT_LE(median(with.p50), 1.1 * median(without.p50));
  EXPECT_LE(median(with.p99), 2.0 * median(without.p99) + 0.5e-3);
  EXPECT_LE(median(with.slipped), 2.0 * median(without.slipped) + 0.01);
}

/// As a compile of everything: four processes for each core that never rest.
class BusyHost {
 public:
  explicit BusyHost(const std::filesystem::path& folder) {
    for (unsigned i = 0; i < 4 * std::max(1U, std::thread::hardware_concurrency()); ++i)
      processes_.push_back(std::make_unique<test::Process>(
          std::vector<std::string>{"/bin/sh", "-c", "while :; do :; done"}, folder / "busy.log"));
  }

 private:
  std::vector<std::unique_ptr<test::Process>> processes_;
};

/// Names of a process's threads that have this niceness or more.
std::set<std::string> nicer_threads(pid_t process, int niceness) {
  std::set<std::string> names;
  for (const auto& task : std::filesystem::directory_iterator("/proc/" + std::to_string(process) + "/task")) {
    const std::string text = read_text(task.path() / "stat");
    const std::size_t open = text.find('('), close = text.rfind(')');
    if (open == std::string::npos || close == std::string::npos) continue;
    std::istringstream fields(text.substr(close + 2));
    std::string field;
    for (int i = 0; i < 17; ++i) fields >> field;  // to the nineteenth
    if (std::stoi(field) >= niceness) names.insert(text.substr(open + 1, close - open - 1));
  }
  return names;
}

// Tries a viewer that starts while others keep every core busy.
TEST(ViewerLoad, OnABusyHostThePageAnswersOnceItsAddressIsPrintedAndTheStopIsConfirmedInTime) {
  RunningSystem system(0, "single_host", "synthetic_viewer");
  ASSERT_TRUE(
      eventually([&] { return system.output().find("All components are ready") != std::string::npos; }, 120))
      << system.output();
  const BusyHost busy(system.folder());
  const auto log = system.folder() / "viewer.log", config = system.folder() / "viewer.yaml";
  std::ofstream(config) << "page: {port: 0}\n";
  const std::vector<std::string> words{PHANTOM_BIN_DIR "/synthetic_viewer", "--config", config.string(),
                                       "--domain", std::to_string(system.network().domain)};
  const test::Process viewer(words, log);
  const std::string said = "operator's page: ";
  std::string url;
  ASSERT_TRUE(eventually(
      [&] {
        const std::string text = read_text(log);
        const std::size_t at = text.find(said), end = text.find("/\n", at);
        if (at == std::string::npos || end == std::string::npos) return false;
        url = text.substr(at + said.size(), end - at - said.size());
        return true;
      },
      120))
      << read_text(log);
  httplib::Client page(url);
  page.set_read_timeout(std::chrono::seconds(20));
  test::LateSleeper late;
  const auto timed = [&](const auto& ask) {
    late.begin();
    const core::Nanoseconds begun_ns = core::monotonic_ns();
    httplib::Result answer = ask();
    return std::pair(std::move(answer), core::seconds(core::monotonic_ns() - begun_ns));
  };
  const auto [first, first_s] = timed([&] { return page.Get("/"); });
  EXPECT_LT(first_s, 1.0 + kThreadsOnTheWay * late.greatest_s()) << "the address was printed";
  ASSERT_TRUE(first && first->status == 200);
  ASSERT_TRUE(eventually(
      [&] {
        const auto state = page.Get("/state");
        return state && state->status == 200 &&
               state->body.find("\"slave\":\"COUPLED\"") != std::string::npos;
      },
      60))
      << "numbers come";
  const std::set<std::string> nice = nicer_threads(viewer.pid(), 1);
  EXPECT_TRUE(nice.contains("viewer")) << "what draws waits for all else";
  for (const char* name : {"page", "page_reader", "scene", "receiver", "dds", "requests", "synthetic_viewe"})
    EXPECT_FALSE(nice.contains(name)) << name << " starves";
  const auto [answer, stopped_s] =
      timed([&] { return page.Post("/command", R"({"kind":"emergency_stop"})", "application/json"); });
  std::cout << "busy host: the stop was confirmed after " << 1e3 * stopped_s << " ms\n";
  ASSERT_TRUE(answer);
  EXPECT_EQ(answer->status, 200) << answer->body;
  EXPECT_LT(stopped_s, 0.3 + kThreadsOnTheWay * late.greatest_s());
}

}  // namespace
}  // namespace phantom::end_to_end

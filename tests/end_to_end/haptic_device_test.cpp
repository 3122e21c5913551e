// The system with a haptic device that another process serves: the shipped example, a plain C program.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <iostream>
#include <map>
#include <mutex>
#include <optional>

#include "common/dds/endpoints/endpoint.hpp"
#include "common/dds/endpoints/stamp.hpp"
#include "tests/end_to_end/running_system.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/late_sleeper.hpp"

namespace phantom::end_to_end {
namespace {

using testing::HasSubstr;

// As deploy/cartesian/hot_cell_haptic_device.yaml has them.
constexpr double kStaleness_s = 0.06, kForceRate_N_per_s = 750.0, kForceLimit_N = 15.0;
constexpr double kThreadsOnTheWay = 5.0,
                 kPeriods_s = 0.05;  // from the device's end to the test's knowledge of it

using Vector = std::array<double, 3>;
Vector of(const msg::Vector3& v) { return {v.x(), v.y(), v.z()}; }
double dot(const Vector& a, const Vector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/// What both topics of the device show to an observer.
struct Observed {
  core::Nanoseconds state_ns = 0,
                    let_go_ns = 0;         // receipt of the newest state; of the first wrench not valid
  std::map<std::uint64_t, Vector> forces;  // of the newest wrenches, by number
  std::optional<msg::HapticDeviceWrench> wrench;
  core::Nanoseconds measured_ns = 0;
  double greatest_N = 0.0, steepest_N_per_s = 0.0, energy_J = 0.0;
  int force_when_invalid = 0;

  void take(const msg::HapticDeviceWrench& w, core::Nanoseconds now_ns) {
    const Vector force = of(w.force_N());
    const double size_N = std::sqrt(dot(force, force));
    if (!w.valid() && size_N > 0.0) ++force_when_invalid;
    if (wrench && wrench->valid() && !w.valid()) let_go_ns = now_ns;
    if (wrench && wrench->stamp().session() == w.stamp().session()) {
      const Vector before = of(wrench->force_N());
      const double dt_s = core::seconds(w.stamp().monotonic_ns() - wrench->stamp().monotonic_ns());
      steepest_N_per_s = std::max(steepest_N_per_s, (size_N - std::sqrt(dot(before, before))) / dt_s);
    }
    greatest_N = std::max(greatest_N, size_N);
    forces[w.stamp().sequence_number()] = force;
    if (forces.size() > 1000) forces.erase(forces.begin());
    wrench = w;
  }
  void take(const msg::HapticDevice& s, core::Nanoseconds now_ns) {
    const auto acted = forces.find(s.wrench_echo().sequence_number());
    const double dt_s = core::seconds(s.stamp().monotonic_ns() - measured_ns);
    if (acted != forces.end() && measured_ns != 0 && dt_s < 0.05)
      energy_J -= dot(acted->second, of(s.velocity_m_s())) * dt_s;
    measured_ns = s.stamp().monotonic_ns();
    state_ns = now_ns;
  }
};

class HapticDevice : public testing::Test {
 protected:
  HapticDevice() {
    system_.emplace(0.0, "haptic_device", "haptic_device_example");
    participant_.emplace("haptic_device_test", system_->network());
    statuses_.emplace(*participant_, dds::kComponentStatus,
                      [this](const msg::ComponentStatus& s, const dds::SampleInfo&) {
                        const std::lock_guard lock(mutex_);
                        if (s.component_name() == "master_io") status_ = s;
                      });
    masters_.emplace(
        *participant_, dds::kMasterState, [this](const msg::MasterState& m, const dds::SampleInfo&) {
          const std::lock_guard lock(mutex_);
          for (std::size_t j = 0; master_ && j < 7; ++j)
            greatest_step_ =
                std::max(greatest_step_, std::abs(m.position_rad()[j] - master_->position_rad()[j]));
          master_ = m;
        });
    slaves_.emplace(*participant_, dds::kSlaveState,
                    [this](const msg::SlaveState& s, const dds::SampleInfo&) {
                      const std::lock_guard lock(mutex_);
                      fastest_tool_m_s_ = std::max(fastest_tool_m_s_, s.tool_speed_m_s());
                    });
    states_.emplace(*participant_, dds::kHapticDevice,
                    [this](const msg::HapticDevice& s, const dds::SampleInfo& info) {
                      const std::lock_guard lock(mutex_);
                      seen_.take(s, info.received_ns);
                    });
    wrenches_.emplace(*participant_, dds::kHapticDeviceWrench,
                      [this](const msg::HapticDeviceWrench& w, const dds::SampleInfo& info) {
                        const std::lock_guard lock(mutex_);
                        seen_.take(w, info.received_ns);
                      });
  }
  void TearDown() override {
    if (!HasFailure()) return;
    std::cerr << system_->output() << read_text(system_->report() / "logs/master_io.log")
              << (device_ ? device_->output() : "") << '\n';
  }
  std::unique_ptr<test::Process> start_device(const char* log) {
    return std::make_unique<test::Process>(
        std::vector<std::string>{PHANTOM_BIN_DIR "/haptic_device_example", "--deployment",
                                 (system_->folder() / "topology.yaml").string(), "--domain",
                                 std::to_string(system_->network().domain)},
        system_->folder() / log);
  }
  template <class Condition>
  bool comes(Condition condition) {
    return eventually(
        [&] {
          const std::lock_guard lock(mutex_);
          return condition();
        },
        90.0);
  }
  bool leads() {
    return comes([&] { return seen_.wrench && seen_.wrench->leads(); });
  }
  bool told(const std::string& words) {
    return comes([&] { return status_ && status_->message().to_string().find(words) != std::string::npos; });
  }
  void expect_let_go() {
    EXPECT_TRUE(comes([&] { return seen_.wrench && !seen_.wrench->valid(); }));
    EXPECT_TRUE(comes([&] { return master_->state() == msg::LinkState::LINK_DEGRADED; }));
    EXPECT_TRUE(told("no matching haptic device"));
    const std::lock_guard lock(mutex_);
    const double after_s = core::seconds(seen_.let_go_ns - seen_.state_ns);
    std::cout << "let go " << 1e3 * after_s << " ms after the device's last state\n";
    EXPECT_GT(after_s, 0.0);
    EXPECT_LT(after_s, kStaleness_s + kPeriods_s + kThreadsOnTheWay * late_.greatest_s());
  }

  test::LateSleeper late_;
  std::mutex mutex_;
  Observed seen_;
  std::optional<msg::ComponentStatus> status_;
  std::optional<msg::MasterState> master_;
  double fastest_tool_m_s_ = 0.0, greatest_step_ = 0.0;
  std::optional<RunningSystem> system_;
  std::unique_ptr<test::Process> device_;
  std::optional<dds::Participant> participant_;
  std::optional<dds::Reader<msg::ComponentStatus>> statuses_;
  std::optional<dds::Reader<msg::MasterState>> masters_;
  std::optional<dds::Reader<msg::SlaveState>> slaves_;
  std::optional<dds::Reader<msg::HapticDevice>> states_;
  std::optional<dds::Reader<msg::HapticDeviceWrench>> wrenches_;
};

TEST_F(HapticDevice, TheExampleLeadsTheArmFeelsDragAndIsLostInBoundedTimeWhenItFreezesOrDies) {
  EXPECT_TRUE(told("no matching haptic device")) << "before it is there";
  device_ = start_device("device.log");
  ASSERT_TRUE(leads());
  EXPECT_TRUE(comes([&] { return fastest_tool_m_s_ > 0.05; })) << "the arm follows the hand";
  EXPECT_TRUE(comes([&] { return seen_.greatest_N > 0.03 && seen_.energy_J > 0.01; }))
      << "drag is felt, and takes energy from the hand";

  late_.begin();
  device_->signal(SIGSTOP);
  expect_let_go();
  device_->signal(SIGCONT);
  ASSERT_TRUE(leads()) << "it comes back by itself: the example's hand lets the clutch out";

  late_.begin();
  device_->end(SIGKILL);
  expect_let_go();
  device_ = start_device("device_again.log");
  ASSERT_TRUE(leads());

  // The restarted one counts as a second one for a while, if it comes soon after the first.
  EXPECT_TRUE(
      comes([&] { return status_->message().to_string().find("two processes") == std::string::npos; }));
  const auto rival = start_device("rival.log");
  EXPECT_TRUE(told("two processes send haptic_device"));
  EXPECT_TRUE(comes([&] { return seen_.wrench->valid(); })) << "the first is used on";
  const auto lines = [&rival] {
    const std::string text = rival->output();
    return std::count(text.begin(), text.end(), '\n');
  };
  EXPECT_TRUE(eventually([&] { return lines() >= 4; }));  // one a second
  EXPECT_THAT(rival->output(), HasSubstr("not taken"));
  EXPECT_THAT(rival->output(), testing::Not(HasSubstr("leads")));
  {
    const std::lock_guard lock(mutex_);
    std::cout << "greatest force " << seen_.greatest_N << " N, steepest rise " << seen_.steepest_N_per_s
              << " N/s, taken from the hand " << seen_.energy_J << " J\n";
    EXPECT_LE(seen_.greatest_N, kForceLimit_N + 1e-9);
    EXPECT_LE(seen_.steepest_N_per_s, 1.001 * kForceRate_N_per_s);
    EXPECT_GT(seen_.energy_J, 0.005);
    EXPECT_EQ(seen_.force_when_invalid, 0);
    EXPECT_LT(greatest_step_, 0.1);
  }
  EXPECT_EQ(device_->end(SIGTERM), 0) << device_->output();
  system_->stop();
  EXPECT_EQ(system_->wait(), 0) << system_->output();
}

}  // namespace
}  // namespace phantom::end_to_end

// The shipped pair of SCARA arms: wva_server and phantom_sensing of both run as shipped, the test plays the
// arms. Each arm's percept rises as the other one comes, equally; an arm that falls silent is felt where it
// was, and then ends the percept.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <csignal>
#include <iostream>
#include <mutex>
#include <thread>

#include "common/messages/codecs/percept_codec.hpp"
#include "common/messages/codecs/status_codec.hpp"
#include "common/messages/codecs/teleoperation_codec.hpp"
#include "common/messages/publisher.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/eventually.hpp"
#include "tests/support/own_domain.hpp"

namespace phantom::end_to_end {
namespace {

using core::JointArray;
using test::eventually;
using test::Process;
using testing::HasSubstr;

constexpr JointArray kHome{0.9, 0.7, 0.05, 0.0}, kOverChannel{-0.40, 1.41, 0.05, 0.0};
/// Links some 4.5 cm from those of an arm over the channel: in the third layer.
constexpr JointArray kNear{-0.25, 1.08, 0.05, 0.0};
constexpr std::uint16_t kFirstOtherArm = 65'000;

/// One arm of the pair: its processes, its played states, and what comes of them.
class Side {
 public:
  Side(const std::string& name, int domain, const std::filesystem::path& folder)
      : name_(name), network_(network_of(name, domain)), participant_("scara_pair_test", network_) {
    states_.emplace(participant_, dds::kSlaveState);
    percepts_.emplace(participant_, dds::kPercept, [this](const msg::Percept& p, const dds::SampleInfo&) {
      const std::lock_guard lock(mutex_);
      percept_ = p;
      ++heard_;
    });
    fields_.emplace(participant_, dds::kDragField, [this](const msg::DragField& f, const dds::SampleInfo&) {
      const std::lock_guard lock(mutex_);
      field_ = f;
    });
    alerts_.emplace(participant_, dds::kHitAlert, [this](const msg::HitAlert& alert, const dds::SampleInfo&) {
      if (!alert.cleared() && alert.object() == kFirstOtherArm) ++alerts_of_other_;
    });
    status_.emplace(participant_, dds::kComponentStatus,
                    [this](const msg::ComponentStatus& s, const dds::SampleInfo&) {
                      const std::lock_guard lock(mutex_);
                      if (s.component_name().to_string() == "phantom_sensing")
                        said_ = s.message().to_string();
                    });
    for (const char* component : {"wva_server", "phantom_sensing"}) {
      const std::filesystem::path log = folder / (name + "_" + component + ".log");
      processes_.push_back(std::make_unique<Process>(
          std::vector<std::string>{std::string(PHANTOM_BIN_DIR "/") + component, "--deployment",
                                   PHANTOM_SOURCE_DIR "/deploy/topologies/scara_pair_" + name + ".yaml",
                                   "--domain", std::to_string(domain)},
          log));
      logs_.push_back(log);
    }
    player_ = std::jthread([this](const std::stop_token& stop) {
      while (!stop.stop_requested()) {
        if (!silent_) send();
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
      }
    });
  }
  ~Side() {
    player_ = {};
    if (testing::Test::HasFailure())
      for (const auto& log : logs_) std::cerr << log << ":\n" << test::read_text(log);
  }

  void stand(const JointArray& q, const JointArray& v = {}) {
    const std::lock_guard lock(mutex_);
    q_ = q, v_ = v;
  }
  void be_silent(bool silent) { silent_ = silent; }
  msg::Percept percept() {
    const std::lock_guard lock(mutex_);
    return percept_;
  }
  msg::DragField field() {
    const std::lock_guard lock(mutex_);
    return field_;
  }
  std::string said() {
    const std::lock_guard lock(mutex_);
    return said_;
  }
  int alerts_of_other() const { return alerts_of_other_; }
  /// Waits for `n` further percepts, and returns the last.
  msg::Percept after(int n) {
    const auto heard = [this] {
      const std::lock_guard lock(mutex_);
      return heard_;
    };
    const int until = heard() + n;
    EXPECT_TRUE(eventually([&] { return heard() >= until; }));
    return percept();
  }

 private:
  static core::NetworkOptions network_of(const std::string& name, int domain) {
    core::NetworkOptions network;
    network.domain = domain;
    network.partition = "scara_pair/" + name;
    network.qos_profiles = PHANTOM_SOURCE_DIR "/deploy/qos/phantom.xml";
    network.interfaces = {"127.0.0.1"};
    return network;
  }
  void send() {
    messages::SlaveState state;
    state.joint_count = 4;
    {
      const std::lock_guard lock(mutex_);
      state.position = q_;
      state.velocity = v_;
    }
    states_->publish(state);
  }

  const std::string name_;
  const core::NetworkOptions network_;
  std::mutex mutex_;
  JointArray q_ = kHome, v_{};
  msg::Percept percept_;
  msg::DragField field_;
  std::string said_;
  int heard_ = 0;
  std::atomic<int> alerts_of_other_ = 0;
  std::atomic<bool> silent_ = false;
  dds::Participant participant_;
  std::optional<messages::Publisher<messages::SlaveState>> states_;
  std::optional<dds::Reader<msg::Percept>> percepts_;
  std::optional<dds::Reader<msg::DragField>> fields_;
  std::optional<dds::Reader<msg::HitAlert>> alerts_;
  std::optional<dds::Reader<msg::ComponentStatus>> status_;
  std::vector<std::unique_ptr<Process>> processes_;
  std::vector<std::filesystem::path> logs_;
  std::jthread player_;
};

class ScaraPair : public testing::Test {
 protected:
  ScaraPair() { std::filesystem::create_directories(folder_); }
  ~ScaraPair() override {
    a_.reset();
    b_.reset();
    std::filesystem::remove_all(folder_);
  }
  const std::filesystem::path folder_ =
      std::filesystem::temp_directory_path() / ("phantom_pair_" + std::to_string(getpid()));
  const int domain_ = test::own_domain();
  std::unique_ptr<Side> a_, b_;
};

// Tries phantom_sensing: no `slave_state` of another arm comes
TEST_F(ScaraPair, SenseEachOtherAndTellWhenOneIsSilent) {
  a_ = std::make_unique<Side>("a", domain_, folder_);
  ASSERT_TRUE(eventually(
      [&] { return a_->said().find("no slave_state comes of scara_b") != std::string::npos; }, 120.0))
      << a_->said();
  EXPECT_FALSE(a_->percept().valid()) << "where the other arm is, nobody knows yet";

  b_ = std::make_unique<Side>("b", domain_, folder_);
  ASSERT_TRUE(eventually([&] { return a_->percept().valid() && b_->percept().valid(); }, 120.0));
  EXPECT_EQ(a_->after(5).mu(), 0.0) << "apart, neither feels the other, nor itself";
  EXPECT_EQ(b_->after(5).mu(), 0.0);

  // b waits over the channel; a comes, step by step.
  b_->stand(kOverChannel);
  double before = 0.0;
  for (int step = 0; step <= 8; ++step) {
    JointArray q = kHome;
    for (std::size_t j = 0; j < 4; ++j) q[j] += 0.125 * step * (kNear[j] - kHome[j]);
    a_->stand(q, {-0.5, 0.3, 0.0, 0.0});
    b_->after(20);
    const msg::Percept of_b = b_->after(5);
    EXPECT_GE(of_b.mu(), before - 1e-9);
    before = of_b.mu();
    for (const double torque : of_b.drag_torque_Nm()) EXPECT_EQ(torque, 0.0) << "it rests: nothing pushes it";
    if (of_b.mu() > 0.0) {
      EXPECT_GT(of_b.speed_m_s(), 0.02) << "relative to the fluid round a";
    }
  }
  EXPECT_EQ(before, 13.0);
  EXPECT_EQ(b_->percept().object(), kFirstOtherArm);
  EXPECT_GT(b_->alerts_of_other(), 0) << "the arm at rest is warned of the one that comes";

  // Alike: the cell is the same, turned by half a turn.
  a_->stand(kOverChannel);
  a_->after(20), b_->after(20);
  ASSERT_GT(a_->percept().mu(), 0.0);
  EXPECT_EQ(a_->percept().mu(), b_->percept().mu());
  EXPECT_EQ(a_->percept().speed_m_s(), 0.0);
  for (std::size_t j = 0; j < 4; ++j) {
    const double a = a_->field().coefficient_plus()[j], b = b_->field().coefficient_plus()[j];
    EXPECT_NEAR(a, b, 0.05 * std::max(a, b) + 1e-6) << "joint " << j + 1;
  }

  // a falls silent: b feels it where it was, and is told; then there is no percept until it is back.
  const double felt = b_->percept().mu();
  a_->be_silent(true);
  ASSERT_TRUE(eventually(
      [&] { return b_->percept().condition() == msg::PerceptCondition::PERCEPT_WORKSPACE_BEHIND; }));
  EXPECT_EQ(b_->percept().mu(), felt);
  ASSERT_TRUE(eventually([&] { return b_->said().find("felt where it was last") != std::string::npos; }))
      << b_->said();
  ASSERT_TRUE(eventually([&] { return !b_->percept().valid(); }));
  EXPECT_EQ(b_->percept().condition(), msg::PerceptCondition::PERCEPT_WORKSPACE_STALE);
  EXPECT_FALSE(b_->field().valid());
  ASSERT_TRUE(eventually([&] { return b_->said().find("scara_a: no percept") != std::string::npos; }))
      << b_->said();
  a_->be_silent(false);
  ASSERT_TRUE(eventually([&] { return b_->percept().valid() && b_->percept().mu() == felt; }));

  a_->stand(kHome);
  ASSERT_TRUE(eventually([&] { return b_->percept().valid() && b_->percept().mu() == 0.0; }));
}

}  // namespace
}  // namespace phantom::end_to_end

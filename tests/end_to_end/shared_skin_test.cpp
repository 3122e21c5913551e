// Two phantom_sensing share the skin of the hot cell's arm, as shipped: what comes over DDS is what one
// process computes, bit for bit, while the other is there, killed, held up and back again. The test plays the
// arm.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <csignal>
#include <deque>
#include <iostream>
#include <map>
#include <mutex>
#include <thread>

#include "common/messages/codecs/percept_codec.hpp"
#include "common/messages/codecs/status_codec.hpp"
#include "common/messages/codecs/teleoperation_codec.hpp"
#include "common/messages/publisher.hpp"
#include "common/percept/closeness.hpp"
#include "common/runtime/cell/cell.hpp"
#include "components/phantom_sensing/model.hpp"
#include "tests/end_to_end/workspace_observer.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/eventually.hpp"
#include "tests/support/own_domain.hpp"

namespace phantom::end_to_end {
namespace {

using test::eventually;
using test::Process;
using testing::HasSubstr;

constexpr const char* kTopology = PHANTOM_SOURCE_DIR "/deploy/topologies/shared_skin.yaml";
constexpr std::size_t kJoints = 7;

/// The arm's n-th state: it weaves over the work table, so that the hand meets fluid.
messages::SlaveState state_of(std::uint64_t n) {
  const double t_s = 0.002 * static_cast<double>(n);
  messages::SlaveState state;
  state.joint_count = kJoints;
  const double middle[kJoints] = {0.0, 0.0, 0.3, -0.2, 0.0, 0.3, 0.0};
  const double swing[kJoints] = {0.3, 0.3, 0.25, 0.25, 0.3, 0.3, 0.3};
  for (std::size_t j = 0; j < kJoints; ++j) {
    const double rad_s = 1.0 + 0.2 * static_cast<double>(j);
    state.position[j] = middle[j] + swing[j] * std::sin(rad_s * t_s);
    state.velocity[j] = swing[j] * rad_s * std::cos(rad_s * t_s);
  }
  return state;
}

class SharedSkin : public testing::Test {
 protected:
  SharedSkin() {
    std::filesystem::create_directories(folder_);
    config_ = phantom_sensing::load_config(PHANTOM_SOURCE_DIR "/deploy/cells/hot_cell/shared_skin.yaml");
    network_.domain = domain_;
    network_.qos_profiles = PHANTOM_SOURCE_DIR "/deploy/qos/phantom.xml";
    network_.interfaces = {"127.0.0.1"};
    participant_.emplace("shared_skin_test", network_);
    observer_.emplace(network_);
    listen();
    server_.emplace(words("wva_server", "wva_server"), folder_ / "server.log");
    arm_.emplace(words("phantom_sensing", "phantom_sensing"), folder_ / "arm.log");
    start_hand();
    states_.emplace(*participant_, dds::kSlaveState);
    player_ = std::jthread([this](const std::stop_token& stop) {
      for (std::uint64_t n = 1; !stop.stop_requested(); ++n) {
        states_->publish(state_of(n));
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
      }
    });
  }
  ~SharedSkin() override {
    player_ = {};
    if (HasFailure())
      for (const char* log : {"server.log", "arm.log", "hand.log"})
        std::cerr << log << ":\n" << test::read_text(folder_ / log);
    hand_.reset();
    arm_.reset();
    server_.reset();
    std::filesystem::remove_all(folder_);
  }

  std::vector<std::string> words(const std::string& component, const std::string& name) const {
    return {std::string(PHANTOM_BIN_DIR "/") + component,
            "--deployment",
            kTopology,
            "--name",
            name,
            "--domain",
            std::to_string(domain_)};
  }
  void start_hand() { hand_.emplace(words("phantom_sensing", "phantom_sensing_hand"), folder_ / "hand.log"); }
  void listen() {
    drag_.emplace(*participant_, dds::kDragField,
                  [this](const msg::DragField& field, const dds::SampleInfo&) {
                    const std::lock_guard lock(mutex_);
                    writers_.insert(field.stamp().session());
                    fields_.push_back(field);
                  });
    percept_.emplace(*participant_, dds::kPercept,
                     [this](const msg::Percept& percept, const dds::SampleInfo&) {
                       const std::lock_guard lock(mutex_);
                       writers_.insert(percept.stamp().session());
                       percepts_[percept.slave_echo().sequence_number()] = percept;
                     });
    alerts_.emplace(*participant_, dds::kHitAlert,
                    [this](const msg::HitAlert& alert, const dds::SampleInfo&) {
                      const std::lock_guard lock(mutex_);
                      writers_.insert(alert.stamp().session());
                      if (!alert.cleared()) ++raised_[alert.alert()];
                    });
    status_.emplace(*participant_, dds::kComponentStatus,
                    [this](const msg::ComponentStatus& sample, const dds::SampleInfo&) {
                      const auto status = messages::from_idl(sample);
                      const std::lock_guard lock(mutex_);
                      if (status) statuses_[status->component] = *status;
                    });
  }
  messages::ComponentStatus status(const std::string& component = "phantom_sensing") {
    const std::lock_guard lock(mutex_);
    return statuses_[component];
  }
  double figure(const std::string& name) {
    for (const auto& figure : status().figures)
      if (figure.name == name) return figure.value;
    return -1.0;
  }
  bool runs_with(double missing) {
    return status().state != core::ComponentState::kStarting && figure("shares_missing") == missing &&
           figure("ticks") > 0.0;
  }

  /// Holds what comes from now on, for `ticks` ticks, against the step of one process.
  void expect_exactly_as_by_one(std::size_t ticks) {
    {
      const std::lock_guard lock(mutex_);
      fields_.clear();
      percepts_.clear();
    }
    ASSERT_TRUE(eventually([&] {
      const std::lock_guard lock(mutex_);
      return fields_.size() > ticks && percepts_.size() > ticks / 20;
    }));
    std::deque<msg::DragField> fields;
    std::map<std::uint64_t, msg::Percept> percepts;
    {
      // What follows takes seconds: a listener that waited for it would hold up its participant, which others
      // would take for lost.
      const std::lock_guard lock(mutex_);
      fields = fields_;
      percepts = percepts_;
    }
    const auto cell = runtime::load_cell(PHANTOM_SOURCE_DIR "/deploy/cells/hot_cell/cell.yaml");
    const auto world = observer_->workspace();
    const phantom_sensing::PhantomModel shared = phantom_sensing::load_model(cell, config_);
    phantom_sensing::PhantomModel unshared = shared;
    unshared.shares.clear();
    phantom_sensing::PhantomSensing by_shares(shared, config_.percept), by_one(unshared, config_.percept);
    std::size_t felt = 0;
    for (const msg::DragField& field : fields) {
      const std::uint64_t n = field.slave_echo().sequence_number();
      ASSERT_TRUE(field.valid()) << "state " << n;
      const messages::SlaveState state = state_of(n);
      phantom_sensing::StepInputs inputs;
      inputs.position = state.position;
      inputs.velocity = state.velocity;
      inputs.workspace = {world.get(), percept::greatest_neighbour_mu(*world)};
      inputs.state_valid = true;
      phantom_sensing::StepOutputs expected, single;
      by_shares.step(inputs, expected);
      by_one.step(inputs, single);
      ASSERT_EQ(field.coefficient_plus(), expected.drag.plus) << "bit for bit, state " << n;
      ASSERT_EQ(field.coupled(), expected.drag.coupled);
      const double greatest = *std::max_element(single.drag.coupled.begin(), single.drag.coupled.end());
      for (std::size_t j = 0; j < kJoints; ++j)
        ASSERT_NEAR(field.coefficient_plus()[j], single.drag.plus[j], 1e-12 * greatest);
      if (!percepts.contains(n)) continue;
      const msg::Percept& percept = percepts.at(n);
      ASSERT_EQ(percept.mu(), single.percept.mu);
      ASSERT_EQ(percept.sensor(), single.percept.sensor);
      ASSERT_EQ(percept.link(), single.percept.link);
      ASSERT_EQ(percept.pgv().x(), single.percept.gradient.pgv_W_m.x());
      ASSERT_EQ(percept.motion(), static_cast<msg::MotionClass>(single.percept.motion));
      felt += single.percept.mu > 0.0 ? 1U : 0U;
    }
    EXPECT_GT(felt, 0U);
    const std::lock_guard lock(mutex_);
    EXPECT_EQ(writers_.size(), 1U) << "one process publishes percept, drag_field and hit_alert";
    for (const auto& [number, times] : raised_) EXPECT_EQ(times, 1) << "alert " << number;
  }

  const std::filesystem::path folder_ =
      std::filesystem::temp_directory_path() / ("phantom_shared_" + std::to_string(getpid()));
  const int domain_ = test::own_domain();
  core::NetworkOptions network_;
  phantom_sensing::Config config_;
  std::mutex mutex_;
  std::deque<msg::DragField> fields_;
  std::map<std::uint64_t, msg::Percept> percepts_;  // by the state's number
  std::map<std::uint32_t, int> raised_;             // by the alert's number
  std::set<std::uint64_t> writers_;
  std::map<std::string, messages::ComponentStatus> statuses_;
  std::optional<dds::Participant> participant_;
  std::optional<WorkspaceObserver> observer_;
  std::optional<dds::Reader<msg::DragField>> drag_;
  std::optional<dds::Reader<msg::Percept>> percept_;
  std::optional<dds::Reader<msg::HitAlert>> alerts_;
  std::optional<dds::Reader<msg::ComponentStatus>> status_;
  std::optional<messages::Publisher<messages::SlaveState>> states_;
  std::optional<Process> server_, arm_, hand_;
  std::jthread player_;
};

// Tries phantom_sensing: the process of a share of the skin is not there, ends, or is late
TEST_F(SharedSkin, IsFeltAsByOneProcessWhateverBecomesOfTheOther) {
  ASSERT_TRUE(eventually([&] { return runs_with(0.0) && observer_->version() != 0; }, 120.0));
  EXPECT_THAT(status("phantom_sensing_hand").message, HasSubstr("senses share hand"));
  double ticks = figure("ticks"), here = figure("shares_sensed_here");
  EXPECT_TRUE(eventually([&] {
    if (!(figure("ticks") > ticks + 500)) return false;
    const double share = (figure("shares_sensed_here") - here) / (figure("ticks") - ticks);
    ticks = figure("ticks"), here = figure("shares_sensed_here");
    return share < 0.9;
  })) << "it is of use";
  expect_exactly_as_by_one(300);

  hand_->signal(SIGSTOP);
  ASSERT_TRUE(eventually([&] { return runs_with(1.0); }));
  EXPECT_THAT(status().message, HasSubstr("do not answer in time, they are sensed here: hand"));
  EXPECT_EQ(status().state, core::ComponentState::kDegraded);
  expect_exactly_as_by_one(200);
  hand_->signal(SIGCONT);
  ASSERT_TRUE(eventually([&] { return runs_with(0.0); }));

  hand_->end(SIGKILL);
  expect_exactly_as_by_one(200);  // from the moment of its end: no gap, nothing invalid
  ASSERT_TRUE(eventually([&] { return runs_with(1.0); }));
  start_hand();
  ASSERT_TRUE(eventually([&] { return runs_with(0.0); }, 60.0));
  expect_exactly_as_by_one(200);
  // A share that a busy machine makes late once degrades it for that moment: it must recover.
  EXPECT_TRUE(eventually([&] { return status().state != core::ComponentState::kDegraded; }))
      << status().message;
}

}  // namespace
}  // namespace phantom::end_to_end

// The rows of Table 6.1 one after the other on one running session with an arm that no counterweights
// balance, commanded by the shell: what the hand, the tone and the view get, and what the report says. Row
// b1, the balanced arm, is that of system_test.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <mutex>
#include <nlohmann/json.hpp>
#include <set>

#include "common/dds/endpoints/endpoint.hpp"
#include "tests/end_to_end/running_system.hpp"
#include "tests/support/child_process.hpp"

namespace phantom::end_to_end {
namespace {

constexpr std::uint32_t kFirstHanging = 1;  // the rail before it is level: no weight, but friction in N

/// The mean of what was seen: the few samples at which the arm sets off count for little.
struct Mean {
  double sum = 0.0;
  int count = 0;
  void add(double value) {
    sum += value;
    ++count;
  }
  double value() const { return count > 0 ? sum / count : 0.0; }
};

double greatest(const auto& values, std::uint32_t first, std::uint32_t count) {
  double most = 0.0;
  for (std::uint32_t j = first; j < count; ++j) most = std::max(most, std::abs(values[j]));
  return most;
}

/// What came over the topics while a row was in force and the operator reached once.
struct Felt {
  double drag_Nm = 0.0;   // greatest on the hand
  Mean free_feedback_Nm;  // the slave's feedback, of the joint with the most, while the arm rests untouched
  Mean free_loop_Nm;      // F_as then
  double tone_gain = 0.0;
  bool hit_view = false;
  int hits = 0;
  std::set<std::string> tone_messages;  // all of the reach: a busy host adds that the percept is stale
};

class PerceptSets : public testing::Test {
 protected:
  PerceptSets()
      : participant_("percept_sets_test", system_.network()),
        masters_(
            participant_, dds::kMasterState,
            [this](const msg::MasterState& m, const dds::SampleInfo&) {
              const std::lock_guard lock(mutex_);
              master_ = m;
              felt_.drag_Nm = std::max(felt_.drag_Nm, greatest(m.percept_torque_Nm(), 0, m.joint_count()));
              if (still_)
                felt_.free_feedback_Nm.add(greatest(m.feedback_torque_Nm(), kFirstHanging, m.joint_count()));
            }),
        slaves_(participant_, dds::kSlaveState,
                [this](const msg::SlaveState& s, const dds::SampleInfo&) {
                  const std::lock_guard lock(mutex_);
                  slave_ = s;
                  quiet_ = !s.contact() && s.tool_speed_m_s() < 0.02 ? quiet_ + 1 : 0;
                  still_ = quiet_ > 100;
                  if (still_)
                    felt_.free_loop_Nm.add(greatest(s.loop_torque_Nm(), kFirstHanging, s.joint_count()));
                }),
        statuses_(participant_, dds::kComponentStatus,
                  [this](const msg::ComponentStatus& s, const dds::SampleInfo&) {
                    if (s.component_name().to_string() != "audio_percept") return;
                    const std::lock_guard lock(mutex_);
                    felt_.tone_messages.insert(s.message().to_string());
                    for (const auto& figure : s.figures()) {
                      if (figure.name().to_string() == "gain")
                        felt_.tone_gain = std::max(felt_.tone_gain, figure.value());
                    }
                  }),
        views_(participant_, dds::kViewPose,
               [this](const msg::ViewPose& v, const dds::SampleInfo&) {
                 const std::lock_guard lock(mutex_);
                 felt_.hit_view = felt_.hit_view || v.view() == msg::ViewKind::VIEW_HIT;
               }),
        hits_(participant_, dds::kHitAlert, [this](const msg::HitAlert& h, const dds::SampleInfo&) {
          const std::lock_guard lock(mutex_);
          felt_.hits += h.cleared() ? 0 : 1;
        }) {}

  void TearDown() override {
    if (HasFailure()) std::cerr << system_.output();
  }
  bool until(auto condition, double limit_s = 60.0) {
    return eventually(
        [&] {
          const std::lock_guard lock(mutex_);
          return master_ && slave_ && condition();
        },
        limit_s);
  }
  void command(const std::string& words) {
    const test::Said said = test::run_line(PHANTOM_BIN_DIR "/master_io command " + words + " --deployment " +
                                           (system_.folder() / "topology.yaml").string() + " --domain " +
                                           std::to_string(system_.network().domain));
    EXPECT_EQ(said.exit_code, 0) << words << ": " << said.output;
  }
  /// Collects from the start of the next reach until the start of the one after it.
  Felt next_reach() {
    int reach = 0;
    EXPECT_TRUE(until([&] { return (reach = master_->reach(), true); }));
    EXPECT_TRUE(until([&] { return master_->reach() > reach; }));
    {
      const std::lock_guard lock(mutex_);
      felt_ = {};
      reach = master_->reach();
    }
    EXPECT_TRUE(until([&] { return master_->reach() > reach; }));
    const std::lock_guard lock(mutex_);
    return felt_;
  }

  // One reach again and again, always with the percept as the operator has chosen it.
  RunningSystem system_{0.0,
                        "single_host",
                        "",
                        {{"slave_io", {{"balanced: true", "balanced: false"}}},
                         {"master_io",
                          {{"only: []", "only: [gripper to waste drum lid]"},
                           {"percept: alternate", "percept: on"},
                           {"in_s: 3 ", "in_s: 2 "},
                           {"back_s: 2 ", "back_s: 1.5 "},
                           {"transit_s: 2 ", "transit_s: 1 "}}}}};
  std::mutex mutex_;
  std::optional<msg::MasterState> master_;
  std::optional<msg::SlaveState> slave_;
  int quiet_ = 0;
  bool still_ = false;
  Felt felt_;
  dds::Participant participant_;
  dds::Reader<msg::MasterState> masters_;
  dds::Reader<msg::SlaveState> slaves_;
  dds::Reader<msg::ComponentStatus> statuses_;
  dds::Reader<msg::ViewPose> views_;
  dds::Reader<msg::HitAlert> hits_;
};

struct Row {
  const char *law, *counterbalance, *percepts, *words;
  bool drag, tone, views;
};

TEST_F(PerceptSets, EachRowOfTheTableGivesTheHandTheToneAndTheViewWhatItHas) {
  ASSERT_TRUE(until([&] {
    return master_->state() == msg::LinkState::LINK_COUPLED &&
           slave_->state() == msg::LinkState::LINK_COUPLED;
  }));
  ASSERT_TRUE(until([&] {
    return std::ranges::any_of(felt_.tone_messages,
                               [](const std::string& message) { return message.starts_with("sounding"); });
  })) << "audio_percept has begun";
  const std::vector<Row> rows{
      {"sctfb", "off", "all", "b2: SCTFB, weight felt: drag, tone and views", true, true, true},
      {"sctfb", "on", "drag,tone", "b2: SCTFB, counterbalanced: drag and tone", true, true, false},
      {"pf", "on", "drag", "a: position forward: drag", true, false, false},
      {"pfff", "on", "tone,views", "c: measured force: tone and views", false, true, true},
      {"pe", "on", "law", "d1: position exchange: tone and views", false, true, true},
      {"peff", "on", "views", "d2: position exchange and measured force: views", false, false, true},
      {"sctfb", "on", "law", "b2: SCTFB, counterbalanced: drag, tone and views", true, true, true}};
  std::map<std::string, Felt> felt;
  for (const Row& row : rows) {
    command(std::string("law ") + row.law);
    command(std::string("counterbalance ") + row.counterbalance);
    command(std::string("percepts ") + row.percepts);
    EXPECT_TRUE(until([&] {
      return master_->drag_chosen() == row.drag && master_->tone_enabled() == row.tone &&
             master_->views_enabled() == row.views &&
             master_->percept_set_automatic() == (std::string(row.percepts) == "law");
    })) << row.words;
    EXPECT_TRUE(until([&] {
      return slave_->counterbalance() == (std::string(row.counterbalance) == "on"
                                              ? msg::Counterbalance::COUNTERBALANCE_AUTOMATIC
                                              : msg::Counterbalance::COUNTERBALANCE_NONE);
    })) << row.words;
    const Felt now = felt[row.words] = next_reach();
    std::cout << row.words << ": drag " << now.drag_Nm << " N·m, slave's feedback at rest "
              << now.free_feedback_Nm.value() << " N·m of F_as " << now.free_loop_Nm.value() << " N·m, tone "
              << now.tone_gain << ", hit view " << now.hit_view << ", alerts " << now.hits << '\n';
    EXPECT_GT(now.hits, 0) << "else there was nothing to show";
    EXPECT_EQ(now.drag_Nm > 0.05, row.drag) << row.words << ": " << now.drag_Nm << " N·m";
    EXPECT_EQ(now.drag_Nm == 0.0, !row.drag) << row.words << ": " << now.drag_Nm << " N·m";
    EXPECT_EQ(now.tone_gain > 0.0, row.tone) << row.words;
    EXPECT_EQ(now.tone_messages.contains("the operator works without the tone: alarms only"), !row.tone)
        << testing::PrintToString(now.tone_messages);
    EXPECT_EQ(now.hit_view, row.views) << row.words;
  }
  const Felt& heavy = felt[rows.front().words];
  const Felt& light = felt[rows.back().words];
  EXPECT_GT(heavy.free_loop_Nm.value(), 20.0) << "N·m: the weight stands in F_as";
  EXPECT_LT(light.free_loop_Nm.value(), 0.2 * heavy.free_loop_Nm.value()) << "N·m: friction is left";
  EXPECT_LT(light.free_feedback_Nm.value(), 0.3 * heavy.free_feedback_Nm.value()) << "and so on the hand";
  system_.stop();
  EXPECT_EQ(system_.wait(), 0);
  const auto summary = nlohmann::json::parse(read_text(system_.report() / "summary.json"));
  std::vector<std::string> sets;
  for (const auto& period : summary["percept_sets"]) sets.push_back(period["set"]);
  for (const Row& row : rows) EXPECT_THAT(sets, testing::Contains(row.words));
}

}  // namespace
}  // namespace phantom::end_to_end

// The shipped state machine and the model of the link are twins. Row by row: the tables that spin prints of
// the model's law, against next_link_state and StopLatch. Tick by tick: traces of the model, driven through
// the controllers of master and slave as they are shipped.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "components/master_io/master_io.hpp"
#include "components/master_io/tests/fixture.hpp"
#include "components/slave_io/slave_io.hpp"
#include "components/slave_io/tests/fixture.hpp"

namespace phantom::model {
namespace {

using teleop::LinkState;
using teleop::ResetOutcome;
using teleop::StopId;

constexpr const char* kTables = PHANTOM_SOURCE_DIR "/tests/model/link_tables.csv";

// The rows of one table, as numbers, without the first column.
std::vector<std::vector<int>> rows_of(const std::string& table) {
  std::vector<std::vector<int>> rows;
  std::ifstream file(kTables);
  for (std::string line; std::getline(file, line);) {
    std::istringstream cells(line);
    std::string cell;
    if (!std::getline(cells, cell, ',') || cell != table) continue;
    std::vector<int> row;
    while (std::getline(cells, cell, ',') && !cell.empty() && std::isdigit(cell[0]) != 0)
      row.push_back(std::stoi(cell));
    if (!row.empty()) rows.push_back(row);
  }
  return rows;
}

TEST(LinkTwin, SR06_SR07_EveryTransitionIsTheModels) {
  const auto rows = rows_of("transition");
  ASSERT_EQ(rows.size(), 6U * 6U * 16U);
  for (const auto& row : rows) {
    const teleop::LinkConditions conditions{.partner_fresh = row[1] != 0,
                                            .aligned = row[2] != 0,
                                            .recovered = row[3] != 0,
                                            .stop = row[4] != 0,
                                            .partner = static_cast<LinkState>(row[5])};
    const LinkState next = teleop::next_link_state(static_cast<LinkState>(row[0]), conditions);
    EXPECT_EQ(static_cast<int>(next), row[6])
        << testing::PrintToString(row) << ": state, fresh, aligned, recovered, stop, partner, next";
  }
}

// The model's state of the latch: a stop is in force, the partner's stop that was named, a fault before, a
// reset that waits for the fault to be gone.
using LatchState = std::array<int, 4>;

// A latch of the product in a state of the model, with what the model's ids are in it.
struct LatchTwin {
  teleop::StopLatch latch;
  std::uint32_t requests = 0;
};

TEST(LinkTwin, SR01_SR02_SR03_SR05_EveryRowOfTheLatchIsTheModels) {
  constexpr std::array<StopId, 3> kPartner{0, 0xA1, 0xB2};
  std::map<LatchState, std::vector<std::vector<int>>> rows;
  std::size_t count = 0;
  for (const auto& row : rows_of("latch")) rows[{row[0], row[1], row[2], row[3]}].push_back(row), ++count;
  ASSERT_EQ(count, 18U * 112U);
  // Breadth first from the two latches that a process may begin with.
  std::map<LatchState, LatchTwin> known{
      {{0, 0, 0, 0}, {teleop::StopLatch(1, {})}},
      {{1, 0, 0, 0}, {teleop::StopLatch(2, {77, teleop::StopCause::kEmergency})}}};
  std::deque<LatchState> todo;
  for (const auto& [state, twin] : known) todo.push_back(state);
  std::size_t judged = 0;
  for (; !todo.empty(); todo.pop_front()) {
    for (const auto& row : rows.at(todo.front())) {
      LatchTwin twin = known.at(todo.front());
      const StopId before = twin.latch.record().id;
      const bool match = row[6] >= 1 && row[6] <= 3;
      const teleop::StopReset reset{.own = match ? before : before + 1,
                                    .partner = row[6] == 0 ? 0 : kPartner.at((row[6] - 1) % 3)};
      twin.requests += row[4];
      const ResetOutcome outcome = twin.latch.step({.requests = twin.requests,
                                                    .drive_fault = row[5] != 0,
                                                    .partner_stopped = row[7] != 0,
                                                    .partner_stop = kPartner.at(std::max(row[7] - 1, 0)),
                                                    .reset = row[6] == 0 ? nullptr : &reset});
      const StopId id = twin.latch.record().id;
      const int stop = id == 0 ? 0 : (id == before ? 1 : 2);
      EXPECT_EQ(stop, row[8]) << testing::PrintToString(row);
      EXPECT_EQ(outcome == ResetOutcome::kReleased, row[11] != 0) << testing::PrintToString(row);
      ++judged;
      const LatchState next{row[8] != 0, row[9], row[5], row[10]};
      if (known.try_emplace(next, twin).second) todo.push_back(next);
    }
    ASSERT_FALSE(testing::Test::HasFailure());
  }
  // The other six cannot be: a fault without a stop, and a reset that waits although no fault is there.
  EXPECT_EQ(known.size(), 12U);
  EXPECT_EQ(judged, 12U * 112U);
}

// One line of a trace: what a side was given in a tick, and what became of it.
struct Tick {
  int side = 0;
  int asked, has_reset, reset_own, reset_partner, fault;
  int heard, age, partner, partner_stop, answers, writer;
  int agree, follows, starved, permits, partner_permits;
  int state, stop, power, accepted, torque;
};

std::istream& operator>>(std::istream& in, Tick& t) {
  char bar = 0;
  return in >> t.side >> bar >> t.asked >> t.has_reset >> t.reset_own >> t.reset_partner >> t.fault >> bar >>
         t.heard >> t.age >> t.partner >> t.partner_stop >> t.answers >> t.writer >> bar >> t.agree >>
         t.follows >> t.starved >> t.permits >> t.partner_permits >> bar >> t.state >> t.stop >> t.power >>
         t.accepted >> t.torque;
}

constexpr double kTick_s = 0.001;
constexpr double kStrong = 1e6;  // beyond any cap

struct Limits {
  int stale = 0, hold = 0, recovery = 0, ramp = 0;
  // Half a tick more, so that a sum of ticks is on the same side of the limit whatever its rounding.
  teleop::LinkTiming timing() const {
    return {.staleness_s = (stale + 0.5) * kTick_s,
            .round_trip_limit_s = 1.0,
            .align_hold_s = (hold + 0.5) * kTick_s,
            .recovery_s = (recovery + 0.5) * kTick_s};
  }
};

master_io::Config master_config(const Limits& limits) {
  auto config = master_io::shipped_config();
  config.link = limits.timing();
  config.percept.ramp_up_s = config.feedback.ramp_up_s = 0.1 * kTick_s;
  config.percept.ramp_down_s = config.feedback.ramp_down_s = (limits.ramp - 0.5) * kTick_s;
  config.percept.smoothing_s = 1e-9;
  config.torque_rate_Nm_per_s.fill(1e12);  // the ramp alone is the model's
  return config;
}
slave_io::Config slave_config(const Limits& limits) {
  auto config = slave_io::shipped_config();
  config.link = limits.timing();
  return config;
}

/// Ids of one side: the model uses an id again once nothing refers to it; the product never does.
class Ids {
 public:
  void put(int model, StopId real) { real_[model] = real; }
  StopId of(int model) const {
    if (model == 0) return 0;
    const auto found = real_.find(model);
    return found == real_.end() ? kNobodys : found->second;  // one that is in force nowhere
  }

 private:
  static constexpr StopId kNobodys = 0xdeadbeef;
  std::map<int, StopId> real_;
};

// Master and slave as they are shipped, each given what the model gave its side.
class Twins {
 public:
  explicit Twins(const Limits& limits)
      : master_config_(master_config(limits)), slave_config_(slave_config(limits)) {
    restart(0);
    restart(1);
  }
  void restart(int side) {
    const teleop::StopLatch latch(++seed_, kept_.at(side));
    requests_.at(side) = 0;
    heard_stop_.at(side) = 0;
    if (side == 0) {
      master_.emplace(master_config_, latch);
    } else {
      slave_.emplace(slave_io::shipped_arm().arm, slave_config_, q_, latch);
    }
  }
  /// Returns what the product did otherwise than the model; empty if nothing.
  std::string tick(const Tick& t) {
    const teleop::StopReset reset{ids_.at(t.side).of(t.reset_own), ids_.at(1 - t.side).of(t.reset_partner)};
    // A second writer's stop that was not heard of in the tick before is a new one, whatever a reset has
    // named.
    if (t.partner_stop == kForeign && heard_stop_.at(t.side) != kForeign)
      ids_.at(1 - t.side).put(kForeign, ++foreign_);
    heard_stop_.at(t.side) = t.partner_stop;
    requests_.at(t.side) += t.asked;
    std::ostringstream difference;
    const teleop::SideOutputs out = t.side == 0 ? master(t, reset, difference) : slave(t, reset, difference);
    kept_.at(t.side) = out.stop;
    if (t.stop != 0) ids_.at(t.side).put(t.stop, out.stop.id);
    if (static_cast<int>(out.state) != t.state)
      difference << "state " << name_of(out.state) << ", model " << name_of(static_cast<LinkState>(t.state))
                 << "; ";
    if ((out.stop.id != 0) != (t.stop != 0))
      difference << "stop " << out.stop.id << ", model " << t.stop << "; ";
    if (t.stop != 0 && (t.stop == stop_.at(t.side)) != (out.stop.id == stop_id_.at(t.side)))
      difference << "another name for the same stop, or the same for another; ";
    if (out.power != (t.power != 0)) difference << "power " << out.power << "; ";
    if (t.has_reset != 0 && (out.reset == ResetOutcome::kReleased) != (t.accepted != 0))
      difference << "reset; ";
    stop_.at(t.side) = t.stop;
    stop_id_.at(t.side) = out.stop.id;
    return difference.str();
  }
  int torques = 0;  ///< ticks with torque on the hand

 private:
  template <class Inputs, class Partner>
  void give(const Tick& t, const teleop::StopReset& reset, Inputs& in, Partner& partner) const {
    if (t.heard != 0) in.partner_age_s = t.age * kTick_s;
    partner.echoes_other_session = t.answers == 2;
    partner.state = static_cast<LinkState>(t.partner);
    partner.stop.id = ids_.at(1 - t.side).of(t.partner_stop);
    in.position = partner.position = q_;
    if (t.agree == 0) partner.position[0] += 1.0;
    in.stop_requests = requests_.at(t.side);
    in.reset = t.has_reset != 0 ? &reset : nullptr;
    in.drives_operational = t.follows != 0;
    in.drive_fault = t.fault != 0;
    in.loop.starved = t.starved != 0;
    in.enabling = t.permits != 0 ? teleop::SwitchState::kHeld : teleop::SwitchState::kReleased;
    partner.motion_permitted = t.partner_permits != 0;
  }
  teleop::SideOutputs master(const Tick& t, const teleop::StopReset& reset, std::ostringstream& difference) {
    master_io::MasterInputs in;
    give(t, reset, in, in.slave);
    in.settings.percept_gain.fill(1.0);
    in.settings.law = master_config_.feedback.law;
    in.velocity.fill(0.1);
    in.drag_age_s = 0.0;
    in.drag.drag.valid = true;
    in.drag.drag.plus.fill(kStrong);
    in.drag.drag.minus.fill(kStrong);
    in.slave.loop_torque_Nm.fill(kStrong);
    master_io::MasterReport report;
    master_->step(in, kTick_s, report);
    const master_io::MasterOutputs& out = report.outputs;
    bool some = false;
    for (std::size_t j = 0; j < master_config_.device.joint_count; ++j) {
      some = some || out.motor_Nm[j] != 0.0;
      const bool within =
          std::abs(report.percept_torque_Nm[j]) <= master_config_.percept.torque_cap_Nm[j] &&
          std::abs(report.feedback_torque_Nm[j]) <= master_config_.feedback.torque_cap_Nm[j] &&
          std::abs(out.motor_Nm[j]) <= master_config_.device.torque_limit_Nm[j];
      if (!within) difference << "torque of joint " << j << " beyond its cap; ";
    }
    torques += some;
    if (some != (t.torque != 0)) difference << "torque " << some << ", model " << t.torque << "; ";
    return out;
  }
  teleop::SideOutputs slave(const Tick& t, const teleop::StopReset& reset, std::ostringstream& difference) {
    slave_io::SlaveInputs in;
    give(t, reset, in, in.master);
    const auto before = reference_;
    const auto out = slave_->step(in, kTick_s);
    reference_ = out.reference;
    if (t.stop != 0 && was_stopped_ && t.follows != 0 && out.reference != before)
      difference << "the arm is led in a stop; ";
    was_stopped_ = t.stop != 0 && t.follows != 0;
    return out;
  }

  static constexpr int kForeign = 7;  // the model's id of a second writer's stop
  StopId foreign_ = 0xf0e1;
  std::array<int, 2> heard_stop_{};
  master_io::Config master_config_;
  slave_io::Config slave_config_;
  core::JointArray q_ = slave_io::shipped_arm().home, reference_{};
  std::optional<master_io::MasterIo> master_;
  std::optional<slave_io::SlaveIo> slave_;
  std::uint64_t seed_ = 0;
  bool was_stopped_ = false;
  std::array<std::uint32_t, 2> requests_{};
  std::array<teleop::StopRecord, 2> kept_{};
  std::array<Ids, 2> ids_;
  std::array<int, 2> stop_{};
  std::array<StopId, 2> stop_id_{};
};

// Drives one trace; returns how often each state was come to.
std::array<int, 6> drive(const std::filesystem::path& file, int& torques) {
  std::ifstream lines(file);
  std::array<int, 6> visits{};
  Limits limits;
  std::string word;
  lines >> word >> limits.stale >> limits.hold >> limits.recovery >> limits.ramp;
  EXPECT_EQ(word, "limits") << file;
  Twins twins(limits);
  int line = 1, side = 0;
  for (Tick t; lines >> word;) {
    ++line;
    if (word == "restart") {
      lines >> side;
      twins.restart(side);
      continue;
    }
    if (word != "tick" || !(lines >> t)) {
      ADD_FAILURE() << file << ":" << line << ": not a line of a trace";
      break;
    }
    ++visits.at(t.state);
    if (const std::string difference = twins.tick(t); !difference.empty()) {
      ADD_FAILURE() << file << ":" << line << ": " << difference;
      break;
    }
  }
  torques += twins.torques;
  return visits;
}

TEST(LinkTwin, SR01_SR02_SR03_SR04_SR05_SR06_SR07_SR08_SR18_SR19_TheModelsTracesDriveTheShippedControllers) {
  int traces = 0, torques = 0;
  std::array<int, 6> visits{};
  for (const auto& entry : std::filesystem::directory_iterator(PHANTOM_TRACE_DIR)) {
    if (entry.path().extension() != ".trace") continue;
    ++traces;
    const auto of_this = drive(entry.path(), torques);
    std::transform(visits.begin(), visits.end(), of_this.begin(), visits.begin(), std::plus<>());
  }
  EXPECT_GE(traces, 6);
  EXPECT_GT(torques, 1000) << "the hand has felt something";
  for (std::size_t state = 0; state < visits.size(); ++state)
    EXPECT_GT(visits.at(state), 100) << name_of(static_cast<LinkState>(state));
}

}  // namespace
}  // namespace phantom::model

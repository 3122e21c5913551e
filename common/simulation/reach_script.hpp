#pragma once

#include <cstddef>
#include <cstdint>
#include <random>
#include <vector>

#include "common/core/joints.hpp"
#include "common/simulation/operator_model.hpp"

namespace phantom::simulation {

/// A way into the cell and back, in joint coordinates.
struct Reach {
  core::JointArray from{};
  core::JointArray target{};  ///< at or behind the object's surface
};

enum class PerceptSchedule { kAlternate, kOn, kOff };

struct ReachScriptParameters {
  std::size_t joint_count = 0;
  std::vector<Reach> reaches;  ///< taken in turn, over and over; at least one
  PerceptSchedule percept =
      PerceptSchedule::kAlternate;  ///< alternate: each reach twice, with the percept, then without
  double first_wait_s = 1.0;        ///< after coupling
  double transit_s = 2.0;           ///< to a reach's start, if the hand is not there
  double in_s = 3.0;                ///< nominal duration of the way in
  double hold_s = 0.3;              ///< at the end of the way in
  double back_s = 2.0;              ///< of the way back
  double pause_s = 0.3;             ///< before the next one
  double overreach = 0.0;           ///< the operator misjudges: aims this share of the way beyond the target
  double duration_scatter =
      0.0;                  ///< relative standard deviation of in_s from pair to pair, same within a pair
  double reaction_s = 0.2;  ///< from contact to letting go
  double patience = 3.0;    ///< gives up a way in that takes this many times in_s
  std::uint32_t seed = 1;
};

enum class ReachPhase { kWait, kTransit, kIn, kHold, kBack, kPause };

/// Leads an OperatorModel through reaches: to the start, in, until the target or a contact (after the
/// reaction time), back. A slave that was lost and cannot come to the master by itself – something is in its
/// way – is met where it is, and the reach is given up. Deterministic for a seed. After construction it
/// allocates nothing.
class ReachScript {
 public:
  ReachScript(const ReachScriptParameters& parameters, OperatorModel& hand);

  /// Advances; call before the hand's own step with the device's true position. `go`: master and slave are
  /// coupled (else everything waits). `contact`: the slave touches something. Real-time safe: yes.
  void step(const core::JointArray& q, bool go, bool contact, double dt_s) noexcept;
  /// In place of step() while the slave is heard and the poses do not agree; `slave_q`: where it is.
  /// Real-time safe: yes.
  void meet(const core::JointArray& slave_q, double dt_s) noexcept;
  /// The hand is on its way to the slave: its reference is to move although nothing is coupled.
  bool meeting() const noexcept { return meeting_; }

  ReachPhase phase() const noexcept { return phase_; }
  /// Running number from 0 of the reach under way, from the start of its way in to the next one's; −1 before
  /// the first.
  std::int32_t number() const noexcept { return number_; }
  /// Whether this reach is made with the percept.
  bool percept_on() const noexcept { return percept_on_; }
  /// Which of the given reaches is under way.
  std::size_t index() const noexcept { return index_; }

 private:
  void begin(ReachPhase phase) noexcept;
  void choose_next() noexcept;
  void begin_way_in() noexcept;

  ReachScriptParameters parameters_;
  OperatorModel& hand_;
  std::mt19937 random_;
  ReachPhase phase_ = ReachPhase::kWait;
  double in_phase_s_ = 0.0, touching_s_ = 0.0, in_s_ = 0.0, apart_s_ = 0.0;
  bool touched_ = false, percept_on_ = true, meeting_ = false;
  std::int32_t number_ = -1;
  std::int32_t planned_ = -1;
  std::size_t index_ = 0;
};

}  // namespace phantom::simulation

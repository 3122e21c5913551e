#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <random>
#include <vector>

#include "common/core/joints.hpp"
#include "common/simulation/operator_model.hpp"

namespace phantom::simulation {

/// What the operator asks of the gripper.
enum class GripperAction : std::uint8_t { kNone, kOpen, kClose };

/// A path into the cell and back, in joint coordinates.
struct Reach {
  core::JointArray from{};
  core::JointArray target{};                     ///< on or behind the object's surface
  GripperAction gripper = GripperAction::kNone;  ///< asked for at the end of the way in
  std::optional<double> hold_s = {};             ///< instead of the script's
  bool once = false;                             ///< left out when the reaches are repeated
  bool presses = false;                          ///< goes on through a contact, as into tissue
};

enum class PerceptSchedule { kAlternate, kOn, kOff };

struct ReachScriptParameters {
  std::size_t joint_count = 0;
  std::vector<Reach> reaches;  ///< made in this order, repeatedly; at least one that is repeated
  /// kAlternate makes each reach twice, first with the percept, then without.
  PerceptSchedule percept = PerceptSchedule::kAlternate;
  double first_wait_s = 1.0;  ///< after coupling
  double transit_s = 2.0;     ///< to the start of a reach, if the hand is not there
  double in_s = 3.0;          ///< nominal duration of the way in
  double hold_s = 0.3;        ///< at the end of the way in
  double back_s = 2.0;        ///< duration of the way back
  double pause_s = 0.3;       ///< before the next reach
  double overreach = 0.0;  ///< the operator's misjudgement: aims beyond the target by this share of the way
  double duration_scatter =
      0.0;                  ///< relative standard deviation of in_s from pair to pair; the same within a pair
  double reaction_s = 0.2;  ///< from contact to releasing the move
  double patience = 3.0;    ///< gives up a way in that lasts longer than this multiple of in_s
  std::uint32_t seed = 1;
};

enum class ReachPhase { kWait, kTransit, kIn, kHold, kBack, kPause };

/// Makes an OperatorModel perform reaches: to the start, in until it arrives at the target or the reaction
/// time after a contact has passed, and back. If the slave was lost and cannot come to the master because
/// something blocks it, the hand moves to the slave and the reach is given up. Deterministic for a given
/// seed. Allocates no memory after construction.
class ReachScript {
 public:
  ReachScript(const ReachScriptParameters& parameters, OperatorModel& hand);

  /// Advances the script. Call it before the hand's own step, with the device's true position. `go`: master
  /// and slave are coupled, else everything waits. `contact`: the slave is in contact. Real-time safe: yes.
  void step(const core::JointArray& q, bool go, bool contact, double dt_s) noexcept;
  /// Replaces step() while the slave is heard and the poses do not agree. `slave_q`: the slave's position.
  /// Real-time safe: yes.
  void meet(const core::JointArray& slave_q, double dt_s) noexcept;
  /// Returns whether the hand is moving to the slave, so that its reference has to move although nothing is
  /// coupled.
  bool meeting() const noexcept { return meeting_; }

  ReachPhase phase() const noexcept { return phase_; }
  /// Returns the running number, from 0, of the present reach; −1 before the first. It changes at the start
  /// of a way in.
  std::int32_t number() const noexcept { return number_; }
  /// Returns how often something was asked of the gripper, and what the last time.
  std::uint32_t gripper_asked() const noexcept { return gripper_asked_; }
  GripperAction gripper_action() const noexcept { return gripper_action_; }
  /// Returns whether the present reach is made with the percept.
  bool percept_on() const noexcept { return percept_on_; }
  /// Returns the index of the present reach in the given reaches.
  std::size_t index() const noexcept { return index_; }

 private:
  void begin(ReachPhase phase) noexcept;
  void begin_hold() noexcept;
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
  std::vector<std::size_t> repeated_;  // of the reaches
  std::uint32_t gripper_asked_ = 0;
  GripperAction gripper_action_ = GripperAction::kNone;
};

}  // namespace phantom::simulation

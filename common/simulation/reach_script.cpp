#include "common/simulation/reach_script.hpp"

#include <algorithm>
#include <cmath>

namespace phantom::simulation {
namespace {

constexpr double kThere = 0.01;       // rad or m: no transit for a smaller distance
constexpr double kMeetAfter_s = 2.0;  // an unobstructed slave has come by itself by then
constexpr double kMeet_s = 1.5;

// Computes a normal deviate as a sum of 12 uniforms (central limit), because the standard library's
// distribution differs between implementations.
double normal_deviate(std::mt19937& random) noexcept {
  double sum = -6.0;
  for (int i = 0; i < 12; ++i) sum += static_cast<double>(random()) / 4294967296.0;
  return sum;
}

}  // namespace

ReachScript::ReachScript(const ReachScriptParameters& parameters, OperatorModel& hand)
    : parameters_(parameters), hand_(hand), random_(parameters.seed), in_s_(parameters.in_s) {
  percept_on_ = parameters_.percept != PerceptSchedule::kOff;
  for (std::size_t i = 0; i < parameters_.reaches.size(); ++i) {
    if (!parameters_.reaches[i].once) repeated_.push_back(i);
  }
}

void ReachScript::begin(ReachPhase phase) noexcept {
  phase_ = phase;
  in_phase_s_ = 0.0;
}

void ReachScript::begin_hold() noexcept {
  const GripperAction action = parameters_.reaches[index_].gripper;
  if (action != GripperAction::kNone) {
    gripper_action_ = action;
    ++gripper_asked_;
  }
  begin(ReachPhase::kHold);
}

void ReachScript::choose_next() noexcept {
  ++planned_;
  const bool pairs = parameters_.percept == PerceptSchedule::kAlternate;
  const auto turn = static_cast<std::size_t>(pairs ? planned_ / 2 : planned_);
  const std::size_t count = parameters_.reaches.size();
  index_ = turn < count || repeated_.empty() ? turn % count : repeated_[(turn - count) % repeated_.size()];
  if (!pairs || planned_ % 2 == 0) {
    in_s_ = parameters_.in_s * std::max(0.5, 1.0 + parameters_.duration_scatter * normal_deviate(random_));
  }
}

void ReachScript::begin_way_in() noexcept {
  const Reach& reach = parameters_.reaches[index_];
  core::JointArray aim{};
  for (std::size_t j = 0; j < parameters_.joint_count; ++j) {
    aim[j] = reach.target[j] + parameters_.overreach * (reach.target[j] - reach.from[j]);
  }
  number_ = planned_;
  percept_on_ = parameters_.percept == PerceptSchedule::kOn ||
                (parameters_.percept == PerceptSchedule::kAlternate && number_ % 2 == 0);
  touched_ = false;
  touching_s_ = 0.0;
  hand_.move_to(aim, in_s_);
  begin(ReachPhase::kIn);
}

void ReachScript::step(const core::JointArray& q, bool go, bool contact, double dt_s) noexcept {
  apart_s_ = 0.0;
  if (!go) return;
  if (meeting_) {
    meeting_ = false;
    if (number_ >= 0) begin(ReachPhase::kHold);  // the way back follows
  }
  in_phase_s_ += dt_s;
  switch (phase_) {
    case ReachPhase::kWait:
    case ReachPhase::kPause:
      if (in_phase_s_ < (phase_ == ReachPhase::kWait ? parameters_.first_wait_s : parameters_.pause_s))
        return;
      choose_next();
      {
        const core::JointArray& start = parameters_.reaches[index_].from;
        double away = 0.0;
        for (std::size_t j = 0; j < parameters_.joint_count; ++j) {
          away = std::max(away, std::abs(start[j] - hand_.reference()[j]));
        }
        if (away <= kThere) return begin_way_in();
        hand_.move_to(start, parameters_.transit_s);
      }
      return begin(ReachPhase::kTransit);
    case ReachPhase::kTransit:
      if (hand_.arrived()) begin_way_in();
      return;
    case ReachPhase::kIn:
      touched_ = touched_ || (contact && !parameters_.reaches[index_].presses);
      if (touched_) touching_s_ += dt_s;
      if (touching_s_ > parameters_.reaction_s || in_phase_s_ > parameters_.patience * in_s_) {
        hand_.release(q);
        return begin_hold();
      }
      if (hand_.arrived()) begin_hold();
      return;
    case ReachPhase::kHold:
      if (in_phase_s_ < parameters_.reaches[index_].hold_s.value_or(parameters_.hold_s)) return;
      hand_.move_to(parameters_.reaches[index_].from, parameters_.back_s);
      return begin(ReachPhase::kBack);
    case ReachPhase::kBack:
      if (hand_.arrived()) begin(ReachPhase::kPause);
      return;
  }
}

void ReachScript::meet(const core::JointArray& slave_q, double dt_s) noexcept {
  apart_s_ += dt_s;
  if (apart_s_ < kMeetAfter_s) return;
  hand_.move_to(slave_q, kMeet_s);
  meeting_ = true;
  apart_s_ = 0.0;  // repeat later, in case the slave has moved meanwhile
}

}  // namespace phantom::simulation

#include "components/synthetic_viewer/stop_board.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "components/synthetic_viewer/state.hpp"

namespace phantom::synthetic_viewer {
namespace {

using core::Side;
using Answer = core::SideAnswer::State;
using Level = SideView::Level;

constexpr const char* kNotStopped = "IS NOT STOPPED";

constexpr std::size_t index_of(Side side) { return static_cast<std::size_t>(side); }

std::string stopped_text(StopCause cause) {
  constexpr std::array<const char*, core::kStopCauses> kTexts{"stopped", "stopped (emergency stop)",
                                                              "stopped (its drives are in fault)",
                                                              "stopped (because the other side is)"};
  return kTexts.at(static_cast<std::size_t>(cause));
}

std::string silent_text(core::Nanoseconds received_ns, core::Nanoseconds now_ns) {
  return received_ns == 0 ? "never heard"
                          : fmt::format("silent for {:.0f} s", core::seconds(now_ns - received_ns));
}

}  // namespace

void StopBoard::take_state(Side side, LinkState link, StopCause cause, std::uint64_t stop,
                           core::Nanoseconds received_ns) {
  const std::lock_guard lock(mutex_);
  State& state = states_[index_of(side)];
  const bool moves = link != LinkState::kStopped;
  if (moves && (state.received_ns == 0 || state.stopped())) state.moving_since_ns = received_ns;
  state.received_ns = received_ns;
  state.link = link;
  state.cause = cause;
  state.stop = stop;
  const bool any = std::any_of(states_.begin(), states_.end(), [](const State& s) { return s.stopped(); });
  if (!any) stopped_since_ns_ = 0;
  if (any && stopped_since_ns_ == 0) stopped_since_ns_ = received_ns;
}

void StopBoard::take_request(const std::optional<core::CommandAnswers>& request) {
  const std::lock_guard lock(mutex_);
  request_ = request;
}

void StopBoard::take_second(const std::string& topic, core::Nanoseconds received_ns) {
  const std::lock_guard lock(mutex_);
  std::erase_if(seconds_, [&](const auto& second) { return received_ns - second.second >= kSecond_ns; });
  if (seconds_.size() < kMostSeconds || seconds_.contains(topic)) {
    seconds_[topic] = received_ns;
  } else {
    crowded_ns_ = received_ns;
    ++forgotten_;
  }
}

std::uint64_t StopBoard::forgotten() const {
  const std::lock_guard lock(mutex_);
  return forgotten_;
}

std::uint64_t StopBoard::stop_of(Side side) const {
  const std::lock_guard lock(mutex_);
  return states_[index_of(side)].stop;
}

StopView StopBoard::at(core::Nanoseconds now_ns) const {
  const std::lock_guard lock(mutex_);
  StopView view;
  view.in_force = request_.has_value() || stopped_since_ns_ != 0;
  for (const auto& [topic, heard_ns] : seconds_) {
    if (now_ns - heard_ns < kSecond_ns)
      view.notices.push_back("two processes send " + topic + ": only the first is heeded; end one of them");
  }
  if (crowded_ns_ != 0 && now_ns - crowded_ns_ < kSecond_ns)
    view.notices.emplace_back("more processes than these send what only one may send");
  if (!view.in_force) return view;
  for (const Side side : core::kSides) {
    view.sides[index_of(side)] = view_of(side, now_ns);
    view.alarm = view.alarm || view.sides[index_of(side)].level == Level::kAlarm;
  }
  view.headline = headline(view);
  return view;
}

/// Returns the view of a side while a stop is in force.
SideView StopBoard::view_of(Side side, core::Nanoseconds now_ns) const {
  const State& state = states_[index_of(side)];
  const bool silent = state.received_ns == 0 || now_ns - state.received_ns > kSilent_ns;
  const Answer answer = request_ ? request_->of(side).state : Answer::kNotAsked;
  if (answer == Answer::kWaiting || answer == Answer::kRefused) {
    if (!request_->overdue(side, now_ns)) return {Level::kWaiting, "is being stopped"};
    std::string text = answer == Answer::kRefused ? "REFUSED THE STOP: " + request_->of(side).message
                                                  : std::string("HAS NOT CONFIRMED THE STOP");
    if (silent) text += " (" + silent_text(state.received_ns, now_ns) + ")";
    return {Level::kAlarm, text};
  }
  if (state.stopped() && !silent) return {Level::kStopped, stopped_text(state.cause)};
  // The side's reply may come before its next state.
  if (answer == Answer::kDone && now_ns - request_->asked_ns() <= core::CommandAnswers::kOverdue_ns)
    return {Level::kStopped, "stopped"};
  if (silent) {
    const std::string words = silent_text(state.received_ns, now_ns);
    if (state.stopped()) return {Level::kWaiting, words + ", stopped when last heard"};
    if (state.received_ns == 0) return {Level::kWaiting, words};
    return {Level::kAlarm, "MAY NOT BE STOPPED (" + words + ")"};
  }
  // The side is not stopped, though the other side is or this one was asked to stop.
  const core::Nanoseconds split_since_ns = std::max(stopped_since_ns_, state.moving_since_ns);
  if (stopped_since_ns_ != 0 && now_ns - split_since_ns > core::CommandAnswers::kOverdue_ns)
    return {Level::kAlarm, std::string(kNotStopped) + " (" + label_of(state.link) + ")"};
  return {Level::kWaiting, label_of(state.link)};
}

bool StopBoard::stopped_by(StopCause cause) const {
  return std::any_of(states_.begin(), states_.end(),
                     [cause](const State& state) { return state.stopped() && state.cause == cause; });
}

std::string StopBoard::headline(const StopView& view) const {
  if (view.alarm && !request_) {
    const bool moves = std::any_of(view.sides.begin(), view.sides.end(), [](const SideView& side) {
      return side.level == Level::kAlarm && side.text.rfind(kNotStopped, 0) == 0;
    });
    return moves ? "ONLY ONE SIDE IS STOPPED" : "STOP NOT CONFIRMED";
  }
  if (view.alarm) return "STOP NOT CONFIRMED";
  if (request_) return "STOPPING";
  if (stopped_by(StopCause::kDriveFault) && !stopped_by(StopCause::kEmergency)) {
    return states_[index_of(Side::kSlave)].cause == StopCause::kDriveFault
               ? "STOPPED: the arm's drives are in fault"
               : "STOPPED: the master's drives are in fault";
  }
  return "EMERGENCY STOP";
}

std::string sides_text(const StopView& view) {
  return "master: " + view.sides[index_of(Side::kMaster)].text +
         " | slave: " + view.sides[index_of(Side::kSlave)].text;
}

}  // namespace phantom::synthetic_viewer

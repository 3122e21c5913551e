#include "components/synthetic_viewer/state/stop_status.hpp"

#include <algorithm>
#include <utility>

#include "components/synthetic_viewer/state/state.hpp"

namespace phantom::synthetic_viewer {
namespace {

using teleop::Side;
using Answer = teleop::SideAnswer::State;
using Level = SideView::Level;

constexpr const char* kMoves = "stop_side.moves";

constexpr std::size_t index_of(Side side) { return static_cast<std::size_t>(side); }

LocalizedText stopped_words(StopCause cause) {
  constexpr std::array<const char*, teleop::kStopCauses> kKeys{
      "stop_side.stopped", "stop_side.stopped_emergency", "stop_side.stopped_drives",
      "stop_side.stopped_other"};
  return {kKeys.at(static_cast<std::size_t>(cause)), {}};
}

LocalizedText silent_words(core::Nanoseconds received_ns, core::Nanoseconds now_ns) {
  if (received_ns == 0) return {"stop_side.never_heard", {}};
  return {"stop_side.silent", {{"seconds", core::seconds(now_ns - received_ns)}}};
}

LocalizedText link_words(LinkState link) { return {"link_state." + label_of(link), {}}; }

SideView side_view(Level level, LocalizedText words) {
  std::string text = english_text(words);
  return {level, std::move(text), std::move(words)};
}

void add_notice(StopView& view, LocalizedText words) {
  view.notices.push_back(english_text(words));
  view.notice_words.push_back(std::move(words));
}

}  // namespace

StopStatus& StopStatus::operator=(const StopStatus& other) {
  if (this == &other) return *this;
  const std::scoped_lock lock(mutex_, other.mutex_);
  states_ = other.states_;
  stopped_since_ns_ = other.stopped_since_ns_;
  request_ = other.request_;
  seconds_ = other.seconds_;
  crowded_ns_ = other.crowded_ns_;
  forgotten_ = other.forgotten_;
  return *this;
}

void StopStatus::take_state(Side side, LinkState link, StopCause cause, std::uint64_t stop,
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

void StopStatus::take_request(const std::optional<teleop::CommandAnswers>& request) {
  const std::lock_guard lock(mutex_);
  request_ = request;
}

void StopStatus::take_second(const std::string& topic, core::Nanoseconds received_ns) {
  const std::lock_guard lock(mutex_);
  std::erase_if(seconds_, [&](const auto& second) { return received_ns - second.second >= kSecond_ns; });
  if (seconds_.size() < kMaxSeconds || seconds_.contains(topic)) {
    seconds_[topic] = received_ns;
  } else {
    crowded_ns_ = received_ns;
    ++forgotten_;
  }
}

std::uint64_t StopStatus::forgotten() const {
  const std::lock_guard lock(mutex_);
  return forgotten_;
}

std::uint64_t StopStatus::stop_of(Side side) const {
  const std::lock_guard lock(mutex_);
  return states_[index_of(side)].stop;
}

StopView StopStatus::at(core::Nanoseconds now_ns) const {
  const std::lock_guard lock(mutex_);
  StopView view;
  view.in_force = request_.has_value() || stopped_since_ns_ != 0;
  for (const auto& [topic, heard_ns] : seconds_) {
    if (now_ns - heard_ns < kSecond_ns) add_notice(view, {"notice.two_processes", {{"topic", topic}}});
  }
  if (crowded_ns_ != 0 && now_ns - crowded_ns_ < kSecond_ns) add_notice(view, {"notice.more", {}});
  if (!view.in_force) return view;
  for (const Side side : teleop::kSides) {
    view.sides[index_of(side)] = view_of(side, now_ns);
    view.alarm = view.alarm || view.sides[index_of(side)].level == Level::kAlarm;
  }
  view.headline_words = headline(view);
  view.headline = english_text(view.headline_words);
  return view;
}

/// Returns the view of a side while a stop is in force.
SideView StopStatus::view_of(Side side, core::Nanoseconds now_ns) const {
  const State& state = states_[index_of(side)];
  const bool silent = state.received_ns == 0 || now_ns - state.received_ns > kSilent_ns;
  const Answer answer = request_ ? request_->of(side).state : Answer::kNotAsked;
  if (answer == Answer::kWaiting || answer == Answer::kRefused) {
    if (!request_->overdue(side, now_ns)) return side_view(Level::kWaiting, {"stop_side.being_stopped", {}});
    LocalizedText words{"stop_side.not_confirmed", {}};
    if (answer == Answer::kRefused) words = {"stop_side.refused", {{"message", request_->of(side).message}}};
    if (silent) {
      words.key += "_silent";
      words.values.push_back({"silent", silent_words(state.received_ns, now_ns)});
    }
    return side_view(Level::kAlarm, std::move(words));
  }
  if (state.stopped() && !silent) return side_view(Level::kStopped, stopped_words(state.cause));
  // The side's reply may come before its next state.
  if (answer == Answer::kDone && now_ns - request_->asked_ns() <= teleop::CommandAnswers::kOverdue_ns)
    return side_view(Level::kStopped, stopped_words(StopCause::kNone));
  if (silent) {
    const LocalizedText words = silent_words(state.received_ns, now_ns);
    if (state.stopped())
      return side_view(Level::kWaiting, {"stop_side.stopped_when_heard", {{"silent", words}}});
    if (state.received_ns == 0) return side_view(Level::kWaiting, words);
    return side_view(Level::kAlarm, {"stop_side.may_move", {{"silent", words}}});
  }
  // The side is not stopped, though the other side is or this one was asked to stop.
  const core::Nanoseconds split_since_ns = std::max(stopped_since_ns_, state.moving_since_ns);
  if (stopped_since_ns_ != 0 && now_ns - split_since_ns > teleop::CommandAnswers::kOverdue_ns)
    return side_view(Level::kAlarm, {kMoves, {{"state", link_words(state.link)}}});
  return side_view(Level::kWaiting, link_words(state.link));
}

bool StopStatus::stopped_by(StopCause cause) const {
  return std::any_of(states_.begin(), states_.end(),
                     [cause](const State& state) { return state.stopped() && state.cause == cause; });
}

LocalizedText StopStatus::headline(const StopView& view) const {
  if (view.alarm && !request_) {
    const bool moves = std::any_of(view.sides.begin(), view.sides.end(), [](const SideView& side) {
      return side.level == Level::kAlarm && side.words.key == kMoves;
    });
    return {moves ? "stop_headline.one_side" : "stop_headline.not_confirmed", {}};
  }
  if (view.alarm) return {"stop_headline.not_confirmed", {}};
  if (request_) return {"stop_headline.stopping", {}};
  if (stopped_by(StopCause::kDriveFault) && !stopped_by(StopCause::kEmergency)) {
    return {states_[index_of(Side::kSlave)].cause == StopCause::kDriveFault ? "stop_headline.slave_drives"
                                                                            : "stop_headline.master_drives",
            {}};
  }
  return {"stop_headline.stopped", {}};
}

std::string sides_text(const StopView& view, Language language, const char* between) {
  const auto side = [&](const char* name, Side which) {
    return in(language, {name, {}}) + ": " + in(language, view.sides[index_of(which)].words);
  };
  return side("side.master", Side::kMaster) + between + side("side.slave", Side::kSlave);
}

}  // namespace phantom::synthetic_viewer

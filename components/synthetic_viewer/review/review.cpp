#include "components/synthetic_viewer/review/review.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "common/core/errors.hpp"

namespace phantom::synthetic_viewer {
namespace {

using Topic = RecordedTopics::Topic;

/// Returns the time that is shown at `now_ns` if nothing holds it up.
core::Nanoseconds played_to(const Review::Position& position, core::Nanoseconds since_ns,
                            core::Nanoseconds now_ns) {
  if (!position.playing) return position.at_ns;
  return position.at_ns + std::llround(position.rate * static_cast<double>(now_ns - since_ns));
}

}  // namespace

Review::Review(std::vector<recording::OpenedRecording> recordings, const robot::SerialArm& arm,
               const OnProgress& on_progress, const std::vector<OtherArmSource>& others)
    : recordings_(std::move(recordings)),
      arm_{.joint_count = arm.joint_count(), .link_count = arm.links().size()},
      others_(others),
      topics_(others) {
  for (const recording::OpenedRecording& opened : recordings_) {
    auto& known = sources_.emplace_back();
    for (const auto& [id, channel] : opened.reader.channels()) known[id] = topics_.source_of(channel);
    for (const std::string& problem : opened.reader.problems())
      problems_.push_back(opened.path.string() + ": " + problem);
  }
  read_all(arm, on_progress);
  if (end_ns_ == 0)
    throw core::ConfigError(
        "the recording has nothing to show: no sample of slave_state, percept and the viewer's other topics that "
        "fits this cell's arm; allowed: a recording of dds_recorder with these topics, and its own cell");
  const std::lock_guard lock(mutex_);
  position_.at_ns = first_pose_ns_ == 0 ? begin_ns_ : first_pose_ns_;
}

void Review::lay_out_series(const robot::SerialArm& arm) {
  const auto add = [this](std::string name, std::string label, std::string unit, std::string plot) {
    series_.push_back(
        {std::move(name), std::move(label), std::move(unit), std::move(plot), ReducedSeries(begin_ns_)});
  };
  add("closeness", "closeness", "", "closeness");
  add("speed", "speed", "m/s", "speed");
  add("slave", "slave", "", "link");
  add("master", "master", "", "link");
  add("contact", "contact", "", "link");
  for (const char* kind : {"percept", "feedback"}) {
    for (std::size_t i = 0; i < arm.joint_count(); ++i) {
      const robot::Joint& joint = arm.joints()[i];
      const bool prismatic = joint.type == robot::JointType::kPrismatic;
      add(fmt::format("{}/{}", kind, i), joint.name, prismatic ? "N" : "N·m", kind);
    }
  }
}

/// Returns what the series and marks take of a recording that is read.
RecordedListener Review::for_plots() {
  const std::size_t joints = arm_.joint_count;
  const auto series = [this](std::size_t number) -> ReducedSeries& { return series_[number].values; };
  enum : std::size_t {
    kCloseness,
    kSpeed,
    kSlave,
    kMaster,
    kContact,
    kTorques
  };  // as lay_out_series() has them
  RecordedListener listener;
  listener.percept = [series](const PerceptSample& percept) {
    if (!percept.valid) return;
    series(kCloseness).take(percept.received_ns, percept.closeness);
    series(kSpeed).take(percept.received_ns, percept.speed_m_s);
  };
  listener.arm = [this, series](const ArmSample& arm) {
    if (first_pose_ns_ == 0) first_pose_ns_ = arm.received_ns;
    series(kSlave).take(arm.received_ns, static_cast<double>(arm.state));
    series(kContact).take(arm.received_ns, arm.contact ? 1.0 : 0.0);
  };
  listener.master = [series, joints](const MasterSample& master) {
    series(kMaster).take(master.received_ns, static_cast<double>(master.state));
    for (std::size_t i = 0; i < joints; ++i) {
      series(kTorques + i).take(master.received_ns, master.percept_torque_Nm[i]);
      series(kTorques + joints + i).take(master.received_ns, master.feedback_torque_Nm[i]);
    }
  };
  return listener;
}

/// Takes an alert down, by the same rule as ViewerState::take().
void Review::mark(const HitSample& hit, const ViewerState& state) {
  const auto open = open_marks_.find(hit.alert);
  if (hit.cleared) {
    if (open == open_marks_.end()) return;
    marks_[open->second].cleared_ns = hit.received_ns;
    open_marks_.erase(open);
    return;
  }
  if (open != open_marks_.end()) return;
  if (marks_.size() >= kMaxMarks) {
    ++marks_left_out_;
    return;
  }
  open_marks_[hit.alert] = marks_.size();
  marks_.push_back({.raised_ns = hit.received_ns,
                    .alert = hit.alert,
                    .rule = hit.rule,
                    .link = hit.link_name.empty() ? fmt::format("link {}", hit.link) : hit.link_name,
                    .object = object_name(state, hit.object),
                    .interest_point = hit.interest_point,
                    .speed_m_s = hit.speed_m_s});
}

recording::SeriesCursor Review::cursor_from(core::Nanoseconds from_ns) const {
  recording::MessageFilter filter;
  filter.from_ns = static_cast<std::uint64_t>(from_ns);
  // Meshes belong to no moment.
  filter.channel = [this](const recording::Channel& channel) {
    const Topic topic = topics_.source_of(channel).topic;
    return topic != Topic::kNone && topic != Topic::kMeshChunk;
  };
  return recording::SeriesCursor(recordings_, filter);
}

const RecordedTopics::Source& Review::source_of(const recording::SeriesCursor::Next& next) const {
  return sources_[next.recording].at(next.message->channel_id);
}

/// Keeps a moment to go on from. If there are too many, every second of them is given up.
void Review::keep(core::Nanoseconds before_ns, const RecordedMoment& moment) {
  moments_.push_back({before_ns, moment});
  moment_bytes_ += moment.bytes();
  while (moments_.size() > 2 && (moments_.size() > kMaxMoments || moment_bytes_ > kMaxMomentBytes)) {
    std::vector<Kept> fewer;
    moment_bytes_ = 0;
    for (std::size_t i = 0; i < moments_.size(); i += 2) {
      moment_bytes_ += moments_[i].moment.bytes();
      fewer.push_back(std::move(moments_[i]));
    }
    moments_ = std::move(fewer);
    spacing_ns_ *= 2;
  }
}

/// Queues a part of a mesh that has not come before.
void Review::keep_mesh(MeshChunkSample chunk) {
  if (mesh_bytes_ + chunk.data.size() > kMaxMeshBytes ||
      !mesh_parts_.emplace(chunk.mesh_hash, chunk.chunk).second)
    return;
  mesh_bytes_ += chunk.data.size() + sizeof chunk + 64;
  meshes_.push_back(std::move(chunk));
}

void Review::read_all(const robot::SerialArm& arm, const OnProgress& on_progress) {
  const auto times = recording::times_of(recordings_);
  const double whole = static_cast<double>(std::max<std::uint64_t>(1, times.second - times.first));
  RecordedMoment moment(arm_, others_);
  RecordedListener listener = for_plots();
  listener.hit = [&](const HitSample& hit) { mark(hit, moment.state); };
  listener.mesh = [this](MeshChunkSample chunk) { keep_mesh(std::move(chunk)); };
  recording::MessageFilter filter;
  filter.channel = [this](const recording::Channel& channel) {
    return topics_.source_of(channel).topic != Topic::kNone;
  };
  recording::SeriesCursor cursor(recordings_, filter);
  core::Nanoseconds due_ns = 0;
  std::uint64_t refused = 0;
  keep(0, moment);
  for (auto next = cursor.peek(); next.message != nullptr; cursor.pop(), next = cursor.peek()) {
    const auto& source = source_of(next);
    const auto at_ns = static_cast<core::Nanoseconds>(next.message->log_time_ns);
    // The time line is that of this arm's session.
    const bool timed = source.topic != Topic::kMeshChunk && source.topic != Topic::kOtherSlaveState;
    if (timed && at_ns > 0) {
      if (series_.empty()) {
        begin_ns_ = at_ns;
        lay_out_series(arm);
        due_ns = at_ns + spacing_ns_;
      } else if (at_ns >= due_ns) {
        keep(at_ns, moment);
        due_ns = at_ns + spacing_ns_;
        if (on_progress)
          on_progress(std::min(1.0, static_cast<double>(next.message->log_time_ns - times.first) / whole));
      }
    }
    const bool taken = topics_.take(source, *next.message, moment, listener);
    refused += taken ? 0 : 1;
    if (taken && timed) end_ns_ = std::max(end_ns_, at_ns);
  }
  for (const std::string& problem : cursor.problems()) problems_.push_back(problem);
  if (refused > 0)
    problems_.push_back(
        fmt::format("{} samples are not heeded: damaged, of another arm, or of a second process", refused));
  if (marks_left_out_ > 0) problems_.push_back(fmt::format("{} alerts more have no mark", marks_left_out_));
  mesh_parts_.clear();
  open_marks_.clear();
}

core::Status Review::control(const ReviewRequest& request, core::Nanoseconds now_ns) {
  const double duration_s = this->duration_s();
  // The page rounds what it was told.
  constexpr double kRounded_s = 1e-3;
  if (request.t_s && !(*request.t_s >= 0.0 && *request.t_s <= duration_s + kRounded_s))
    return core::Status::invalid_argument(
        fmt::format("t must be a number from 0 to {:.3f}, the recording's length in s", duration_s));
  if (request.rate && !(*request.rate >= ReviewRequest::kMinRate && *request.rate <= ReviewRequest::kMaxRate))
    return core::Status::invalid_argument("rate must be a number from 0.1 to 10");
  const std::lock_guard lock(mutex_);
  position_.at_ns = std::min(end_ns_, played_to(position_, since_ns_, now_ns));
  since_ns_ = now_ns;
  if (request.t_s) {
    position_.at_ns = std::min(end_ns_, begin_ns_ + core::from_seconds(*request.t_s));
    jump_ = true;
  }
  if (request.rate) position_.rate = *request.rate;
  if (request.play) {
    position_.playing = *request.play;
    const bool again = *request.play && !request.t_s && position_.at_ns >= end_ns_;
    if (again) position_.at_ns = begin_ns_;
    jump_ = jump_ || again;
  }
  return core::Status::ok();
}

Review::Position Review::position(core::Nanoseconds now_ns) const {
  const std::lock_guard lock(mutex_);
  Position position = position_;
  position.at_ns = std::min(end_ns_, played_to(position_, since_ns_, now_ns));
  position.playing = position_.playing && position.at_ns < end_ns_;
  return position;
}

void Review::choose(const Command& command) {
  ViewerState taken;
  taken.take(command);
  const std::lock_guard lock(mutex_);
  if (command.kind == CommandKind::kViewNode)
    node_ = taken.chosen == ViewNode::kAutomatic ? std::nullopt : std::optional(taken.chosen);
  if (command.kind == CommandKind::kViewHold) hold_ = taken.hold ? std::optional(true) : std::nullopt;
}

StopView Review::stops() const {
  const std::lock_guard lock(mutex_);
  return stops_;
}

/// Brings the moment to `at_ns`, and notes the alerts on the way if it goes on from where it is.
void Review::go_to(core::Nanoseconds at_ns, std::vector<HitSample>* hits) {
  const auto after = std::ranges::upper_bound(moments_, at_ns, {}, &Kept::before_ns);
  const Kept& kept = *std::prev(after);  // the first is from before all
  // Who wants every alert on the way leaves nothing out.
  const bool goes_on =
      moment_ && at_ns >= reached_ns_ && (hits != nullptr || reached_ns_ + 1 >= kept.before_ns);
  if (!goes_on) {
    moment_ = kept.moment;
    cursor_ = cursor_from(kept.before_ns);
  }
  RecordedListener listener;
  if (hits != nullptr) listener.hit = [hits](const HitSample& hit) { hits->push_back(hit); };
  for (auto next = cursor_->peek();
       next.message != nullptr && next.message->log_time_ns <= static_cast<std::uint64_t>(at_ns);
       cursor_->pop(), next = cursor_->peek())
    topics_.take(source_of(next), *next.message, *moment_, listener);
  reached_ns_ = at_ns;
}

Review::Shown Review::advance(core::Nanoseconds now_ns, ViewerState& state) {
  constexpr core::Nanoseconds kMaxStep_ns = 5 * core::kNsPerSecond;
  Shown shown;
  std::optional<ViewNode> node;
  std::optional<bool> hold;
  {
    const std::lock_guard lock(mutex_);
    position_.at_ns = std::min(end_ns_, played_to(position_, since_ns_, now_ns));
    position_.playing = position_.playing && position_.at_ns < end_ns_;
    since_ns_ = now_ns;
    shown.at_ns = position_.at_ns;
    shown.jumped = std::exchange(jump_, false) || !moment_ || shown.at_ns < reached_ns_ ||
                   shown.at_ns - reached_ns_ > kMaxStep_ns;
    node = node_;
    hold = hold_;
  }
  go_to(shown.at_ns, shown.jumped ? nullptr : &shown.hits);
  ViewerState then = moment_->state;
  then.cameras = state.cameras;
  then.recording = state.recording;
  then.graphics = state.graphics;
  then.stops = moment_->stops.at(shown.at_ns);
  if (node) then.chosen = *node;
  if (hold) then.hold = *hold;
  state = std::move(then);
  const std::lock_guard lock(mutex_);
  stops_ = state.stops;
  return shown;
}

}  // namespace phantom::synthetic_viewer

#pragma once

// Between topics and samples: included by the DDS adapter and its tests alone.

#include <set>

#include "common/dds/followed_source.hpp"
#include "common/dds/sole_source.hpp"
#include "common/messages/percept_codec.hpp"
#include "common/messages/teleoperation_codec.hpp"
#include "components/audio_percept/audio_percept.hpp"

namespace phantom::audio_percept {

/// Converts the samples of one topic. `accept` returns false for what must be refused, and then leaves `out`
/// alone: also what another process sends than the one that the topic is taken from, as long as that one is
/// heard. has_second() tells of it, to any thread.
class PerceptConverter {
 public:
  bool accept(const msg::Percept& message, core::Nanoseconds received_ns, PerceptSample& out);
  bool has_second(core::Nanoseconds now_ns) const { return source_.has_second(now_ns); }
  /// The process that the percept is taken from, for its alerts.
  const dds::FollowedSource& followed() const { return followed_; }

 private:
  dds::SoleSource source_;
  dds::FollowedSource followed_;
};

class LinkConverter {
 public:
  /// MasterState or SlaveState.
  template <class Message>
  bool accept(const Message& message, core::Nanoseconds received_ns, LinkSample& out) {
    const auto state = messages::from_idl(message);
    if (!state || !source_.accept(message.stamp(), received_ns)) return false;
    out = {received_ns, state->state, state->stop.cause};
    return true;
  }
  bool has_second(core::Nanoseconds now_ns) const { return source_.has_second(now_ns); }

 private:
  dds::SoleSource source_;
};

/// Keeps the alerts that are not over; a restarted sender's earlier ones are. Between two alerts nothing
/// tells whether their sender is still there: they are those of the phantom whose percept is heard.
class AlertConverter {
 public:
  /// `phantom` must outlive the converter. Without it alerts of any sender are taken.
  explicit AlertConverter(const dds::FollowedSource* phantom = nullptr) : phantom_(phantom) {}
  bool accept(const msg::HitAlert& message, core::Nanoseconds received_ns, AlertSample& out);

 private:
  const dds::FollowedSource* phantom_;
  dds::SequenceGuard guard_;
  std::uint64_t session_ = 0;
  std::set<std::uint32_t> active_;
  core::Nanoseconds raised_ns_ = 0;
};

class ViewConverter {
 public:
  bool accept(const msg::ViewPose& message, core::Nanoseconds received_ns, ViewSample& out);
  bool has_second(core::Nanoseconds now_ns) const { return source_.has_second(now_ns); }

 private:
  dds::SoleSource source_{core::kNsPerSecond};  // 10 Hz
};

/// Keeps what of the operator's commands concerns the ear; the others are accepted and pass.
class CommandConverter {
 public:
  bool accept(const msg::OperatorCommand& message, core::Nanoseconds received_ns, CommandSample& out);

 private:
  CommandSample latest_;
};

}  // namespace phantom::audio_percept

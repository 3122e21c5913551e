#pragma once

// Conversion from topic messages to samples: included only by the DDS adapter and its tests.

#include <set>
#include <type_traits>

#include "common/dds/arbitration/followed_source.hpp"
#include "common/dds/arbitration/sole_source.hpp"
#include "common/messages/codecs/percept_codec.hpp"
#include "common/messages/codecs/teleoperation_codec.hpp"
#include "components/audio_percept/audio_percept.hpp"

namespace phantom::audio_percept {

/// Converts the messages of one topic. `accept` returns false and leaves `out` unchanged for a message that
/// must be refused. That includes messages of a second process while the followed one is heard; has_second()
/// reports such a process, on any thread.
class PerceptConverter {
 public:
  bool accept(const msg::Percept& message, core::Nanoseconds received_ns, PerceptSample& out);
  bool has_second(core::Nanoseconds now_ns) const { return source_.has_second(now_ns); }
  /// Returns the process that the percept is taken from, so that alerts are taken from the same.
  const dds::FollowedSource& followed() const { return followed_; }

 private:
  dds::SoleSource source_;
  dds::FollowedSource followed_;
};

class LinkConverter {
 public:
  /// `Message` is MasterState or SlaveState.
  template <class Message>
  bool accept(const Message& message, core::Nanoseconds received_ns, LinkSample& out) {
    const auto state = messages::from_idl(message);
    if (!state || !source_.accept(message.stamp(), received_ns)) return false;
    out = {received_ns, state->state, state->stop.cause};
    if constexpr (std::is_same_v<Message, msg::MasterState>) out.tone_enabled = state->tone_enabled;
    return true;
  }
  bool has_second(core::Nanoseconds now_ns) const { return source_.has_second(now_ns); }

 private:
  dds::SoleSource source_;
};

/// Keeps the alerts that have not been cleared; a restarted sender's earlier alerts count as cleared. Between
/// two alerts nothing shows whether their sender is still present, so alerts are taken from the phantom whose
/// percept is followed.
class AlertConverter {
 public:
  /// `phantom` must outlive the converter. If it is null, alerts of any sender are taken.
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
  dds::SoleSource source_{core::kNsPerSecond};  // view_pose comes at 10 Hz
};

/// Keeps the operator's commands that concern the sound; all others are accepted and ignored.
class CommandConverter {
 public:
  bool accept(const msg::OperatorCommand& message, core::Nanoseconds received_ns, CommandSample& out);

 private:
  CommandSample latest_;
};

}  // namespace phantom::audio_percept

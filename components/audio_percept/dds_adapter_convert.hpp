#pragma once

// Between topics and samples: included by the DDS adapter and its tests alone.

#include <set>

#include "common/dds/stamp.hpp"
#include "components/audio_percept/audio_percept.hpp"
#include "phantom_idl/percept.h"
#include "phantom_idl/teleoperation.h"

namespace phantom::audio_percept {

/// Converts the samples of one topic. `accept` returns false for what must be refused, and then leaves `out`
/// alone.
class PerceptConverter {
 public:
  bool accept(const msg::Percept& message, core::Nanoseconds received_ns, PerceptSample& out);

 private:
  dds::SequenceGuard guard_;
};

class LinkConverter {
 public:
  /// MasterState or SlaveState.
  template <class Message>
  bool accept(const Message& message, core::Nanoseconds received_ns, LinkSample& out) {
    return accept(message.stamp(), message.state(), message.stop_cause(), message.joint_count(), received_ns,
                  out);
  }

 private:
  bool accept(const msg::Stamp& stamp, msg::LinkState state, msg::StopCause cause, std::uint32_t joint_count,
              core::Nanoseconds received_ns, LinkSample& out);
  dds::SequenceGuard guard_;
};

/// Keeps the alerts that are not over; a restarted sender's earlier ones are.
class AlertConverter {
 public:
  bool accept(const msg::HitAlert& message, core::Nanoseconds received_ns, AlertSample& out);

 private:
  dds::SequenceGuard guard_;
  std::uint64_t session_ = 0;
  std::set<std::uint32_t> active_;
  core::Nanoseconds raised_ns_ = 0;
};

class ViewConverter {
 public:
  bool accept(const msg::ViewPose& message, core::Nanoseconds received_ns, ViewSample& out);

 private:
  dds::SequenceGuard guard_;
};

/// Keeps what of the operator's commands concerns the ear; the others are accepted and pass.
class CommandConverter {
 public:
  bool accept(const msg::OperatorCommand& message, core::Nanoseconds received_ns, CommandSample& out);

 private:
  CommandSample latest_;
};

}  // namespace phantom::audio_percept

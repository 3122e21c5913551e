#pragma once

#include <functional>
#include <mutex>
#include <span>
#include <utility>

#include "common/dds/guid_prefix.hpp"

namespace phantom::dds {

/// By it a participant's own thread has the transport make Fast DDS forget whom it has not heard for its
/// lease: where all are silent, no datagram would. Thread-safe.
///
/// Fast DDS is given leases that never end. With its own, a thread of its events looks at them; a process
/// ends by an assertion if that happens in the moment in which another thread works off the participant's
/// departure or the process's own end (PDP::check_remote_participant_liveliness; 2.9.1 and 3.1.2).
class SilenceWatch {
 public:
  using Look = std::function<void(std::span<const GuidPrefix> present)>;

  /// `look` is called by ask(), until another one is set.
  void answer_by(Look look) {
    const std::lock_guard lock(mutex_);
    look_ = std::move(look);
  }
  /// `present`: whom Fast DDS knows. It reports whom it forgets before this returns.
  void ask(std::span<const GuidPrefix> present) {
    const std::lock_guard lock(mutex_);
    if (look_) look_(present);
  }

 private:
  std::mutex mutex_;
  Look look_;
};

}  // namespace phantom::dds

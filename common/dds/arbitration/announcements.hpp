#pragma once

#include <cstddef>
#include <mutex>
#include <utility>
#include <vector>

#include "common/core/clock.hpp"
#include "common/core/recent_map.hpp"
#include "common/dds/admission/guid_prefix.hpp"
#include "common/wire/message.hpp"

namespace phantom::dds {

/// Who has announced itself of late, and where it takes announcements, as the transport saw it. Fast DDS 3
/// reports a participant of a secured site only after its handshake, so that this alone shows one whose
/// handshake does not succeed. It also carries who was lost from RediscoveryManager to the transport, and who
/// of them has returned. Bounded; thread-safe.
class Announcements {
 public:
  static constexpr std::size_t kMax = 1024;
  struct Announced {
    GuidPrefix participant{};
    wire::Source listens{};  ///< port 0: it has not said where
  };

  /// Takes an announcement, or a departure, which ends what was announced.
  void note(const wire::ParticipantFact& fact, core::Nanoseconds now) {
    const std::lock_guard lock(mutex_);
    if (fact.departs) {
      heard_.erase(fact.announced);
    } else {
      heard_.find_or_add(fact.announced).first = {fact.listens, now + core::from_seconds(fact.lease_s)};
    }
  }
  /// Returns those whose lease has not run out.
  std::vector<Announced> present(core::Nanoseconds now) const {
    const std::lock_guard lock(mutex_);
    std::vector<Announced> present;
    heard_.for_each([&](const GuidPrefix& participant, const Heard& heard) {
      if (heard.until >= now) present.push_back({participant, heard.listens});
    });
    return present;
  }

  /// Reports to the transport that Fast DDS has forgotten a participant whose lease ran out.
  void lose(const GuidPrefix& participant) {
    const std::lock_guard lock(mutex_);
    if (lost_.size() < kMax) lost_.push_back(participant);
  }
  /// Returns those that were lost since the last call.
  std::vector<GuidPrefix> take_lost() {
    const std::lock_guard lock(mutex_);
    return std::exchange(lost_, {});
  }
  /// Reports that one that was lost has been heard again. Whoever never announced itself is left out.
  void returns(const GuidPrefix& participant) {
    const std::lock_guard lock(mutex_);
    const Heard* heard = heard_.find(participant);
    if (heard != nullptr && returned_.size() < kMax) returned_.push_back({participant, heard->listens});
  }
  /// Returns those that have returned since the last call, with where they listened before.
  std::vector<Announced> take_returned() {
    const std::lock_guard lock(mutex_);
    return std::exchange(returned_, {});
  }

 private:
  struct Heard {
    wire::Source listens{};
    core::Nanoseconds until = 0;
  };
  mutable std::mutex mutex_;
  core::RecentMap<GuidPrefix, Heard> heard_{kMax};
  std::vector<GuidPrefix> lost_;
  std::vector<Announced> returned_;
};

}  // namespace phantom::dds

#pragma once

#include <cstddef>
#include <functional>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include "common/core/recent_map.hpp"
#include "common/dds/admission/guid_prefix.hpp"
#include "common/dds/arbitration/discovery.hpp"

namespace phantom::dds {

/// Judges the leases of other participants in place of Fast DDS. Its own timer ends the process by an
/// assertion if it runs out while a departure of the same participant is processed
/// (PDP::check_remote_participant_liveliness).
///
/// The transport shows Fast DDS a lease that never ends (wire::kUncheckedLease_s). Where nothing of a
/// participant was handed on for the lease that it announced, the transport has Fast DDS forget it by a
/// departure. This class carries the announced leases, and who has lapsed, between the transport and
/// RediscoveryManager, which reports such a participant as lost and not as one that left. Bounded;
/// thread-safe.
class LeaseMonitor {
 public:
  static constexpr std::size_t kMax = 1024;

  /// Sets what look() calls; nothing: the transport has ended. Waits until a look() in progress is over.
  void attach(std::function<void()> look) {
    const std::lock_guard lock(looking_);
    look_ = std::move(look);
  }
  /// Has the transport look for participants that have lapsed.
  void look() {
    const std::lock_guard lock(looking_);
    if (look_) look_();
  }
  /// Takes the lease that a participant has announced.
  void announced(const GuidPrefix& participant, double lease_s) {
    const std::lock_guard lock(mutex_);
    leases_.find_or_add(participant).first.lease_s = lease_s;
  }
  /// Reports that a participant's lease has run out.
  void lapse(const GuidPrefix& participant) {
    const std::lock_guard lock(mutex_);
    leases_.find_or_add(participant).first.lapsed = true;
    fresh_.push_back(participant);
  }
  /// Returns those that have lapsed since the last call, for Fast DDS to forget.
  std::vector<GuidPrefix> take_lapsed() {
    const std::lock_guard lock(mutex_);
    return std::exchange(fresh_, {});
  }
  /// Returns the event as it would be if Fast DDS had judged: with the announced lease, and lost, not left,
  /// if the lease had run out.
  FoundParticipant judged(FoundParticipant found);

 private:
  struct Lease {
    std::optional<double> lease_s;
    bool lapsed = false;
  };
  std::mutex looking_, mutex_;
  std::function<void()> look_;
  core::RecentMap<GuidPrefix, Lease> leases_{kMax};
  std::vector<GuidPrefix> fresh_;
};

}  // namespace phantom::dds

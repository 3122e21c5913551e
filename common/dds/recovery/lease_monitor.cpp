#include "common/dds/recovery/lease_monitor.hpp"

#include <cmath>

#include "common/dds/admission/handshake_watch.hpp"
#include "common/dds/endpoints/participant_impl.hpp"

namespace phantom::dds {

FoundParticipant LeaseMonitor::judged(FoundParticipant found) {
  const GuidPrefix prefix = prefix_of(found.guid);
  const std::lock_guard lock(mutex_);
  const Lease* const known = leases_.find(prefix);
  if (known == nullptr) return found;
  if (known->lease_s) {
    const double seconds = std::floor(*known->lease_s);
    found.lease = {static_cast<std::int32_t>(seconds),
                   static_cast<std::uint32_t>(1e9 * (*known->lease_s - seconds))};
  }
  if (found.event == Discovered::kFound) {
    leases_.find_or_add(prefix).first.lapsed = false;
  } else if (found.event == Discovered::kLeft || found.event == Discovered::kLost) {
    if (known->lapsed) found.event = Discovered::kLost;
    leases_.erase(prefix);
  }
  return found;
}

}  // namespace phantom::dds

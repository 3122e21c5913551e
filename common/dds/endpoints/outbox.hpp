#pragma once

#include <atomic>
#include <cstdint>
#include <mutex>
#include <vector>

#include "common/core/clock.hpp"
#include "common/core/recent_map.hpp"
#include "fast_dds/transport.hpp"

namespace phantom::dds {

/// Messages that leave by a participant's own sockets, right after the next message that the participant
/// sends: at the latest with its announcement, once a second. A peer knows a participant by its sockets, and
/// believes no other one (wire::Guard). Thread-safe.
class Outbox {
 public:
  static constexpr std::size_t kMaxOpened = 8192;

  /// Fast DDS has opened the way to that address. Debian's Fast DDS 2.9.1 aborts when it sends to another
  /// (OutputTrafficManager::set_statistics_message_data), as to one that a stranger has invented. Of too many
  /// addresses the one that was opened, kept or written to longest ago is forgotten.
  void opened(const fast_dds::rtps::Locator_t& locator);
  /// Says that a peer at these addresses is present: called now and then, it keeps them from being forgotten
  /// for those that a stranger invents.
  void keep(const fast_dds::rtps::LocatorList_t& addresses);
  /// Puts a message; those of `to` that have not been opened are left out.
  void put(std::vector<std::uint8_t> message, fast_dds::rtps::LocatorList_t to);

  /// Sends by `sender` what was put. The participant sends each message by each of its senders in turn; so
  /// does this, and then forgets. Cheap while there is nothing.
  void send_by(fast_dds::rtps::SenderResource& sender);
  /// Returns how many addresses were forgotten for others.
  std::uint64_t forgotten() const {
    const std::lock_guard lock(mutex_);
    return opened_.dropped();
  }

 private:
  /// All senders of a participant have sent its message within this time.
  static constexpr core::Nanoseconds kInTurn = 20 * core::kNsPerMillisecond;
  struct Letter {
    std::vector<std::uint8_t> message;
    fast_dds::rtps::LocatorList_t to;
    core::Nanoseconds first = 0;
    std::vector<const void*> sent_by;
  };

  std::atomic<bool> any_{false};
  mutable std::mutex mutex_;
  std::vector<Letter> letters_;
  core::RecentMap<fast_dds::rtps::Locator_t, bool> opened_{kMaxOpened};
};

}  // namespace phantom::dds

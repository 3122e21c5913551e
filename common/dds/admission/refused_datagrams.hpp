#pragma once

#include <array>
#include <cstdint>
#include <mutex>
#include <string>
#include <vector>

#include "common/core/clock.hpp"
#include "common/wire/fault.hpp"
#include "common/wire/participants.hpp"

namespace phantom::dds {

/// How many datagrams came from one address. A datagram names its sender's address itself: whoever forges the
/// one can forge the other.
struct Sender {
  std::uint32_t address = 0;  ///< IPv4, host byte order
  std::uint64_t count = 0;
};

/// Counts datagrams by their senders' addresses, in memory for kMax of them, however many there are
/// (Space-Saving; Metwally, Agrawal and El Abbadi 2005): one that is new takes the place of the least, and
/// who sends more than a kMax-th of all has a place. Not thread-safe. Real-time safe: yes.
class SenderCounts {
 public:
  static constexpr std::size_t kMax = 16;

  void add(std::uint32_t address);
  /// Returns the greatest sender, and how many came from it at least: exactly, if there were no more than
  /// kMax senders. {0, 0} before the first.
  Sender greatest() const;

 private:
  struct Place {
    std::uint32_t address = 0;
    std::uint64_t count = 0, inherited = 0;  // of the count: from others that had this place before
  };
  std::array<Place, kMax> places_;
};

/// Datagrams that a participant has refused for one reason.
struct Refused {
  wire::Fault fault = wire::Fault::kNone;
  std::uint64_t count = 0;
  wire::Source last;  ///< the sender of the last one
  Sender greatest;    ///< the address that sent most of them, and how many at least
};

/// Counts refused datagrams by reason and, for each reason, by sender. Thread-safe.
class RefusedDatagrams {
 public:
  void add(wire::Fault fault, const wire::Source& source) {
    const std::lock_guard lock(mutex_);
    Count& one = by_fault_[static_cast<std::size_t>(fault)];
    ++one.count;
    one.last = source;
    one.senders.add(source.address);
  }
  /// Returns the reasons for which any was refused.
  std::vector<Refused> list() const;
  /// Logs what was refused since the last call that logged, reason by reason, at most every kEvery.
  void log(const std::string& component, core::Nanoseconds now);

 private:
  static constexpr core::Nanoseconds kEvery = 5 * core::kNsPerSecond;
  struct Count {
    std::uint64_t count = 0;
    wire::Source last;
    SenderCounts senders;
  };
  mutable std::mutex mutex_;
  std::array<Count, wire::kFaults> by_fault_;
  std::array<std::uint64_t, wire::kFaults> logged_{};
  core::Nanoseconds quiet_until_ = 0;
};

/// Returns "10.30.1.2", at most 15 octets.
std::string address_text(std::uint32_t address);
/// Returns "10.30.1.2:7410".
std::string to_text(const wire::Source& source);

}  // namespace phantom::dds

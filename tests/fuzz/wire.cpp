// Any octets as a series of datagrams, from two senders, at a guard: no read leaves them, none of them makes
// the guard keep more than its limits, and what it hands on is sound when it is checked again.

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <vector>

#include "common/wire/guard.hpp"

namespace wire = phantom::wire;

namespace {

struct Receiver {
  explicit Receiver(bool with_security)
      : secured(with_security), guard({.receiver = {with_security}, .participants = 8}) {}

  void receive(std::vector<std::uint8_t> datagram, const wire::Source& source,
               phantom::core::Nanoseconds now) {
    if (wire::check_message(datagram, {secured}, *facts) != wire::Fault::kNone) return;
    const std::size_t departing = facts->participant_count;
    if (guard.check(datagram, *facts, source, true, now) != wire::Fault::kNone) return;
    if (guard.to_hold() && departing > 0) guard.held(facts->participants[0].announced, now);
    const std::vector<std::uint8_t> passed = datagram;
    if (wire::check_message(datagram, {secured}, *facts) != wire::Fault::kNone || datagram != passed)
      std::abort();
    for (const auto& whole : guard.assembled()) {
      std::vector<std::uint8_t> copy(whole.begin(), whole.end());
      if (wire::check_message(copy, {secured}, *facts) != wire::Fault::kNone) std::abort();
    }
  }

  bool secured;
  wire::Guard guard;
  std::unique_ptr<wire::MessageFacts> facts = std::make_unique<wire::MessageFacts>();
};

}  // namespace

/// Input: a flag, then datagrams, each after its length (two octets) and a third octet: sender and time.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  Receiver receiver((data[0] & 1) != 0);
  phantom::core::Nanoseconds now = phantom::core::kNsPerSecond;
  std::size_t at = 1;
  while (size - at >= 3) {
    const std::size_t length = std::min<std::size_t>(data[at] | data[at + 1] << 8, size - at - 3);
    const wire::Source source{0x7f000001, static_cast<std::uint16_t>(40000 + (data[at + 2] & 1))};
    now += (data[at + 2] >> 1) * phantom::core::kNsPerMillisecond * 20;
    receiver.receive({data + at + 3, data + at + 3 + length}, source, now);
    at += 3 + length;
  }
  return 0;
}

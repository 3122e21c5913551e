#include "common/wire/fault.hpp"

#include <iterator>

namespace phantom::wire {

const char* words_of(Fault fault) noexcept {
  constexpr const char* kWords[] = {
      "sound",
      "no header of RTPS 2",
      "a submessage does not fit",
      "a malformed set of sequence or fragment numbers",
      "an impossible sequence number",
      "malformed inline QoS",
      "a missing or unknown payload",
      "fragment numbers that contradict each other",
      "a malformed parameter list",
      "a malformed parameter",
      "a built-in endpoint used by another writer",
      "a malformed handshake",
      "a malformed secured submessage",
      "a sample larger than the endpoint carries",
      "another fragment size than before",
      "too many participants",
      "too many endpoints of one participant",
      "too many messages of discovery",
      "too many messages of unannounced participants",
      "sequence numbers that would take too long to count",
      "a sender outside of the topology's networks",
      "fragments from an unknown participant",
      "another participant's identity",
      "a departure that was forged",
      "a participant that is being forgotten",
      "a participant that sent more than is kept",
  };
  static_assert(std::size(kWords) == kFaults);
  return kWords[static_cast<std::size_t>(fault)];
}

}  // namespace phantom::wire

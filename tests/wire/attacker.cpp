// A stranger on the network: sends damaged RTPS messages to ports of loopback, as fast as it is told, and
// prints how many. The same seed sends the same.
//
//   attacker SEED DATAGRAMS PER_SECOND PORT...
#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <iterator>
#include <random>
#include <thread>
#include <vector>

#include "common/wire/tests/messages.hpp"

namespace {

using namespace phantom::wire;
using namespace phantom::wire::test;

class Attacker {
 public:
  explicit Attacker(std::uint64_t seed) : random_(seed) {}

  std::vector<std::uint8_t> next() {
    switch (below(9)) {
      case 0:
      case 1:
        return fragments();
      case 2:
        return damaged(announcement(anybody(), word()));
      case 3:
        return damaged(endpoint_announcement({anybody(), word()}, 1 + below(9)));
      case 4:
        return damaged(departure(anybody()));
      case 5:
        return counts();
      case 6:
        return damaged(handshake());
      case 7:
        return damaged(sealed());
      default:
        return announcement(anybody(), word());  // sound: a flood of participants
    }
  }

 private:
  std::uint32_t below(std::uint32_t limit) { return static_cast<std::uint32_t>(random_() % limit); }
  template <class T, std::size_t N>
  T one_of(const T (&values)[N]) {
    return values[below(N)];
  }
  std::uint32_t word() {
    return one_of<std::uint32_t>(
        {0, 1, 2, 3, 4, 255, 256, 65535, 65536, 0x7fffffff, 0x80000000, 0xffffffff, 0x103});
  }
  /// A few known prefixes, again and again, and any other.
  GuidPrefix anybody() { return peer(static_cast<int>(below(2) == 0 ? below(4) : below(65536))); }

  /// Several DATA_FRAG whose numbers are edges, and only sometimes fit together.
  std::vector<std::uint8_t> fragments() {
    std::vector<std::uint8_t> whole = header(anybody());
    const auto count = 1 + below(4);
    for (std::uint32_t i = 0; i < count; ++i) {
      const bool builtin = below(2) == 0;
      Octets fields;
      fields.u16(0).u16(one_of<std::uint32_t>({28, 28, 28, 16, 0, 40, 0x7fff, 0xffff}));
      fields.entity(builtin ? kParticipantReader : 0x104).entity(builtin ? kParticipantWriter : 0x103);
      fields.sequence(1 + below(4)).u32(one_of<std::uint32_t>({0, 1, 2, 3, 65536, 0x7fffffff, 0xffffffff}));
      fields.u16(one_of<std::uint32_t>({0, 1, 2, 3, 100, 65535}));
      fields.u16(one_of<std::uint32_t>({0, 1, 2, 4, 8, 16, 64, 100, 256, 1000, 32767, 65535}));
      fields.u32(one_of<std::uint32_t>({0, 1, 3, 64, 200, 1000, 65535, 0x7fffffff, 0xffffffff}));
      const bool inline_qos = below(2) == 0;
      if (inline_qos) fields.parameter(Pid::kKeyHash, Octets().guid({anybody(), 0x103})).sentinel();
      fields.bytes.resize(fields.bytes.size() + one_of<std::size_t>({0, 1, 4, 64, 256, 1000}), 0x41);
      auto one = submessage(SubmessageId::kDataFrag, (inline_qos ? 2 : 0) | (below(4) == 0 ? 4 : 0), fields);
      if (below(5) == 0) one[2] = static_cast<std::uint8_t>(below(256));
      whole.insert(whole.end(), one.begin(), one.end());
    }
    return whole;
  }

  std::vector<std::uint8_t> counts() {
    const auto sequence = [&] {
      return static_cast<std::int64_t>(word()) << one_of<int>({0, 0, 32, 16}) | below(9);
    };
    Octets fields;
    fields.entity(one_of<EntityId>({0, kPublicationReader, kParticipantReader, 0x104}));
    fields.entity(one_of<EntityId>({kPublicationWriter, kSubscriptionWriter, 0x103})).sequence(sequence());
    const auto id =
        one_of<SubmessageId>({SubmessageId::kHeartbeat, SubmessageId::kAckNack, SubmessageId::kGap,
                              SubmessageId::kNackFrag, SubmessageId::kHeartbeatFrag});
    if (id == SubmessageId::kHeartbeat || id == SubmessageId::kGap) fields.sequence(sequence());
    fields.u32(word()).u32(word()).u32(word());
    return message({submessage(id, static_cast<int>(below(8)), fields)}, anybody());
  }

  std::vector<std::uint8_t> handshake() {
    Octets payload = Octets().u8({0, 1, 0, 0});
    payload.bytes.resize(100, 1);
    payload.text("dds.sec.auth").u32(1).text("DDS:Auth:PKI-DH:1.0+Req").u32(word()).u32(word());
    return message({submessage(SubmessageId::kData, 4,
                               data_fields(kStatelessReader, kStatelessWriter, 1, Octets(), payload))},
                   anybody());
  }

  /// What only a secured participant looks at: a message or a submessage in a frame, with keys that nobody
  /// has.
  std::vector<std::uint8_t> sealed() {
    const bool whole = below(2) == 0;
    Octets prefix, body(false), postfix(false);
    prefix.u32(2).u32(word()).u32(word()).u32(word()).u32(word());  // AES-GCM, key, session, counter
    const std::uint32_t length = one_of<std::uint32_t>({0, 1, 16, 64, 300, 0x7fffffff});
    body.u32(length);
    body.bytes.resize(4 + std::min<std::uint32_t>(length, 300), 0x41);
    body.align();
    postfix.u32(1).u32(2).u32(3).u32(4).u32(one_of<std::uint32_t>({0, 1, 2, 0xffffffff}));
    postfix.bytes.resize(postfix.bytes.size() + 20 * below(3), 7);
    return message(
        {submessage(whole ? SubmessageId::kSecureRtpsPrefix : SubmessageId::kSecurePrefix, 0, prefix),
         submessage(SubmessageId::kSecureBody, 0, body),
         submessage(whole ? SubmessageId::kSecureRtpsPostfix : SubmessageId::kSecurePostfix, 0, postfix)},
        anybody());
  }

  /// Flips, cuts, repeats or overwrites a little of a sound message.
  std::vector<std::uint8_t> damaged(std::vector<std::uint8_t> message) {
    const auto at = [&] {
      return kHeaderBytes + below(static_cast<std::uint32_t>(message.size() - kHeaderBytes));
    };
    for (std::uint32_t i = below(4); i > 0; --i) {
      switch (below(4)) {
        case 0:
          message[at()] = static_cast<std::uint8_t>(below(256));
          break;
        case 1:
          message[at()] ^= static_cast<std::uint8_t>(1 << below(8));
          break;
        case 2: {
          const std::uint32_t value = word();
          std::size_t place = at() / 4 * 4;
          for (int k = 0; k < 4 && place < message.size(); ++k)
            message[place++] = static_cast<std::uint8_t>(value >> 8 * k);
          break;
        }
        default:
          message.resize(std::max<std::size_t>(at(), kHeaderBytes + 4));
      }
    }
    return message;
  }

  std::mt19937_64 random_;
};

}  // namespace

int main(int argc, char** argv) {
  if (argc < 5) {
    std::fprintf(stderr, "usage: attacker SEED DATAGRAMS PER_SECOND PORT...\n");
    return 2;
  }
  Attacker attacker(std::strtoull(argv[1], nullptr, 10));
  const long long datagrams = std::atoll(argv[2]), per_second = std::atoll(argv[3]);
  const int out = socket(AF_INET, SOCK_DGRAM, 0);
  const auto start = std::chrono::steady_clock::now();
  long long sent = 0;
  for (; sent < datagrams; ++sent) {
    const auto message = attacker.next();
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    to.sin_port = htons(static_cast<std::uint16_t>(std::atoi(argv[4 + sent % (argc - 4)])));
    [[maybe_unused]] const auto octets =
        sendto(out, message.data(), message.size(), 0, reinterpret_cast<sockaddr*>(&to), sizeof to);
    if (sent % 64 == 63)
      std::this_thread::sleep_until(start +
                                    std::chrono::nanoseconds((sent + 1) * 1'000'000'000 / per_second));
  }
  close(out);
  std::printf("%lld\n", sent);
  return 0;
}

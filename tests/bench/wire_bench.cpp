// What the guard on the wire costs: its decision about one datagram.
#include <benchmark/benchmark.h>

#include <memory>
#include <string>
#include <vector>

#include "common/wire/guard.hpp"
#include "common/wire/message.hpp"
#include "common/wire/tests/messages.hpp"

namespace phantom {
namespace {

using Datagram = std::vector<std::uint8_t>;

constexpr wire::Source kSender{0x7f000001, 40000};
constexpr wire::EntityId kWriter = 0x103, kReader = 0x104;

wire::test::Octets payload(std::size_t octets) {
  wire::test::Octets filled = wire::test::Octets().u8({0, 1, 0, 0});
  filled.bytes.resize(octets, 7);
  return filled;
}

/// As Fast DDS sends a sample of a servo: destination, time, data.
Datagram sample() {
  using namespace wire;
  const auto data = test::data_fields(kReader, kWriter, 5, test::Octets(), payload(400));
  return test::message(
      {test::submessage(SubmessageId::kInfoDestination, 0, test::Octets().raw(test::peer(99))),
       test::submessage(SubmessageId::kInfoTimestamp, 0, test::Octets().u32(1).u32(2)),
       test::submessage(SubmessageId::kData, 4, data)},
      test::peer(1));
}

/// A part of a brick.
Datagram fragment() {
  wire::test::Fragments one{.fragment_bytes = 15000, .sample_bytes = 60000, .carried = 15000};
  return wire::test::message({wire::test::fragment_submessage(one)}, wire::test::peer(1));
}

/// A participant's announcement on a secured site: its certificate's and permissions' names, and eight
/// addresses. Types are announced by name alone, so nothing of discovery that ours send is larger.
Datagram long_announcement() {
  using namespace wire;
  test::Octets list = test::participant_list(test::peer(1));
  for (std::uint32_t port = 7410; port < 7418; ++port)
    list.parameter(Pid::kDefaultUnicastLocator, test::locator(0x0a1e0102, port))
        .parameter(Pid::kMetatrafficUnicastLocator, test::locator(0x0a1e0102, port));
  for (const Pid token : {Pid::kIdentityToken, Pid::kPermissionsToken}) {
    test::Octets held = test::Octets().text("DDS:Auth:PKI-DH:1.0").u32(4);
    for (const char* name : {"dds.cert.sn", "dds.cert.algo", "dds.ca.sn", "dds.ca.algo"})
      held.text(name).text(std::string(60, 'x'));
    list.parameter(token, held.u32(0));
  }
  list.parameter(Pid::kParticipantSecurity, test::Octets().u32(0x8000000e).u32(0x80000000)).sentinel();
  return test::message({test::submessage(SubmessageId::kData, 4,
                                         test::data_fields(kParticipantReader, kParticipantWriter, 1,
                                                           test::Octets(), test::encapsulated(list)))},
                       test::peer(1));
}

/// The most that one datagram can ask for: an announcement of 60 kB of empty parameters.
Datagram full_announcement() {
  using namespace wire;
  test::Octets list = test::participant_list(test::peer(1));
  while (list.bytes.size() < 60'000) list.parameter(Pid::kPad, test::Octets());
  return test::message(
      {test::submessage(SubmessageId::kData, 4,
                        test::data_fields(kParticipantReader, kParticipantWriter, 1, test::Octets(),
                                          test::encapsulated(list.sentinel())))},
      test::peer(1));
}

void decide(benchmark::State& state, const Datagram& datagram, bool discovery, bool secured = false) {
  wire::Guard guard({.receiver = {secured}, .discovery_per_s = 1e12, .discovery_burst = 1e12});
  const auto facts = std::make_unique<wire::MessageFacts>();
  core::Nanoseconds now = core::kNsPerSecond;
  for (int peer = 0; peer < 16; ++peer) {
    Datagram known = wire::test::announcement(wire::test::peer(peer));
    if (wire::check_message(known, {secured}, *facts) != wire::Fault::kNone ||
        guard.check(known, *facts, kSender, true, now) != wire::Fault::kNone)
      return state.SkipWithError("an announcement is refused");
  }
  Datagram received = datagram;
  for (auto _ : state) {
    now += 1000;
    const wire::Fault fault =
        guard.admits(kSender) ? wire::check_message(received, {secured}, *facts) : wire::Fault::kSource;
    if (fault != wire::Fault::kNone ||
        guard.check(received, *facts, kSender, discovery, now) != wire::Fault::kNone)
      return state.SkipWithError("a sound datagram is refused");
  }
}
BENCHMARK_CAPTURE(decide, sample, sample(), false)->Name("decide/sample");
BENCHMARK_CAPTURE(decide, heartbeat, wire::test::heartbeat({wire::test::peer(1), kWriter}, 3, 5), false)
    ->Name("decide/heartbeat");
BENCHMARK_CAPTURE(decide, fragment, fragment(), false)->Name("decide/fragment");
BENCHMARK_CAPTURE(decide, announcement, wire::test::announcement(wire::test::peer(1)), true)
    ->Name("decide/announcement");
BENCHMARK_CAPTURE(decide, endpoint, wire::test::endpoint_announcement({wire::test::peer(1), kWriter}), true)
    ->Name("decide/endpoint");
BENCHMARK_CAPTURE(decide, sealed, wire::test::sealed(wire::test::peer(1), 400), false, true)
    ->Name("decide/sealed");
BENCHMARK_CAPTURE(decide, handshake, wire::test::handshake(wire::test::peer(1)), true, true)
    ->Name("decide/handshake");
BENCHMARK_CAPTURE(decide, long_announcement, long_announcement(), true)->Name("decide/long_announcement");
BENCHMARK_CAPTURE(decide, full_announcement, full_announcement(), true)->Name("decide/full_announcement");

}  // namespace
}  // namespace phantom

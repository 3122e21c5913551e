// What the guard on the wire costs: its decision about one datagram, and a sample's way to another
// participant and back, by UDP on loopback, with the guard and without it.
#include <benchmark/benchmark.h>

#include <chrono>
#include <condition_variable>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <functional>
#include <memory>
#include <mutex>
#include <vector>

#include "common/dds/guarded_transport.hpp"
#include "common/dds/topics.hpp"
#include "common/wire/tests/messages.hpp"
#include "fast_dds/participants.hpp"
#include "fast_dds/transport.hpp"

namespace phantom {
namespace {

namespace edds = eprosima::fastdds::dds;
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

void decide(benchmark::State& state, const Datagram& datagram, bool discovery) {
  wire::Guard guard({.discovery_per_s = 1e12, .discovery_burst = 1e12});
  const auto facts = std::make_unique<wire::MessageFacts>();
  core::Nanoseconds now = core::kNsPerSecond;
  for (int peer = 0; peer < 16; ++peer) {
    Datagram known = wire::test::announcement(wire::test::peer(peer));
    if (wire::check_message(known, false, *facts) != wire::Fault::kNone ||
        guard.check(known, *facts, kSender, true, now) != wire::Fault::kNone)
      return state.SkipWithError("an announcement is refused");
  }
  Datagram received = datagram;
  for (auto _ : state) {
    now += 1000;
    const wire::Fault fault =
        guard.admits(kSender) ? wire::check_message(received, false, *facts) : wire::Fault::kSource;
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

/// A participant that writes one topic and listens to another.
class Side : edds::DataReaderListener {
 public:
  Side(bool guarded, const char* writes, const char* reads, std::function<void(Side&)> received)
      : received_(std::move(received)) {
    auto udp = std::make_shared<fast_dds::rtps::UDPv4TransportDescriptor>();
    udp->interfaceWhiteList = {"127.0.0.1"};
    edds::DomainParticipantQos qos = edds::PARTICIPANT_QOS_DEFAULT;
    qos.transport().use_builtin_transports = false;
    if (guarded) {
      qos.transport().user_transports.push_back(std::make_shared<dds::GuardedTransportDescriptor>(udp));
    } else {
      qos.transport().user_transports.push_back(udp);
    }
    participant_ = edds::DomainParticipantFactory::get_instance()->create_participant(kDomain, qos);
    const edds::TypeSupport type = dds::kMasterState.make_type();
    type.register_type(participant_, dds::kMasterState.type_name);
    const auto topic = [&](const char* name) {
      return participant_->create_topic(name, dds::kMasterState.type_name, edds::TOPIC_QOS_DEFAULT);
    };
    edds::DataWriterQos writer = edds::DATAWRITER_QOS_DEFAULT;
    writer.reliability().kind = edds::BEST_EFFORT_RELIABILITY_QOS;
    writer_ =
        participant_->create_publisher(edds::PUBLISHER_QOS_DEFAULT)->create_datawriter(topic(writes), writer);
    reader_ = participant_->create_subscriber(edds::SUBSCRIBER_QOS_DEFAULT)
                  ->create_datareader(topic(reads), edds::DATAREADER_QOS_DEFAULT, this);
  }
  Side(const Side&) = delete;
  Side& operator=(const Side&) = delete;
  ~Side() override {
    participant_->delete_contained_entities();
    edds::DomainParticipantFactory::get_instance()->delete_participant(participant_);
  }
  void send() { writer_->write(&state_); }

 private:
  static constexpr edds::DomainId_t kDomain = 77;
  void on_data_available(edds::DataReader* reader) override {
    msg::MasterState state;
    edds::SampleInfo info;
    while (fast_dds::ok(reader->take_next_sample(&state, &info)))
      if (info.valid_data) received_(*this);
  }

  std::function<void(Side&)> received_;
  edds::DomainParticipant* participant_ = nullptr;
  edds::DataWriter* writer_ = nullptr;
  edds::DataReader* reader_ = nullptr;
  msg::MasterState state_;
};

/// Counts what has come back.
class Returned {
 public:
  void add() {
    {
      const std::lock_guard lock(mutex_);
      ++count_;
    }
    changed_.notify_one();
  }
  bool wait_for_another(std::chrono::milliseconds limit) {
    std::unique_lock lock(mutex_);
    const bool came = changed_.wait_for(lock, limit, [&] { return count_ > seen_; });
    seen_ = count_;
    return came;
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  long count_ = 0, seen_ = 0;
};

void round_trip(benchmark::State& state, bool guarded) {
  fast_dds::deliver_by_transport();
  Returned returned;
  Side echo(guarded, "back", "there", [](Side& side) { side.send(); });
  Side asking(guarded, "there", "back", [&](Side&) { returned.add(); });
  bool found = false;
  for (int i = 0; i < 300 && !found; ++i) {
    asking.send();
    found = returned.wait_for_another(std::chrono::milliseconds(100));
  }
  if (!found) return state.SkipWithError("the two participants do not find each other");
  for (auto _ : state) {
    asking.send();
    if (!returned.wait_for_another(std::chrono::seconds(5))) return state.SkipWithError("a sample was lost");
  }
}
BENCHMARK_CAPTURE(round_trip, bare, false)->Name("round_trip/bare")->UseRealTime();
BENCHMARK_CAPTURE(round_trip, guarded, true)->Name("round_trip/guarded")->UseRealTime();

}  // namespace
}  // namespace phantom

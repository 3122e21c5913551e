// What the guard and DDS Security cost on the way: a small sample to another participant and back, by UDP on
// loopback.
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
#include <optional>
#include <string>

#include "common/dds/admission/guarded_transport.hpp"
#include "common/dds/endpoints/security.hpp"
#include "common/dds/endpoints/topics.hpp"
#include "fast_dds/participants.hpp"
#include "fast_dds/transport.hpp"
#include "tests/bench/security_site.hpp"

namespace phantom {
namespace {

namespace edds = eprosima::fastdds::dds;

constexpr edds::DomainId_t kDomain = 77;

/// What stands between a sample and the wire.
enum class Protection {
  kNone,        ///< Fast DDS as it comes
  kGuarded,     ///< the guard
  kSecured,     ///< the guard and DDS Security by the shipped governance
  kRtpsSigned,  ///< the same, with every message signed as a whole, too (rtps_protection_kind SIGN)
};

/// A participant that writes one topic and listens to another.
class Side : edds::DataReaderListener {
 public:
  /// `site`: null without security.
  Side(const char* identity, Protection protection, const bench::SecuritySite* site, const char* writes,
       const char* reads, std::function<void(Side&)> received)
      : received_(std::move(received)) {
    auto udp = std::make_shared<fast_dds::rtps::UDPv4TransportDescriptor>();
    udp->interfaceWhiteList = {"127.0.0.1"};
    edds::DomainParticipantQos qos = edds::PARTICIPANT_QOS_DEFAULT;
    qos.transport().use_builtin_transports = false;
    if (protection == Protection::kNone) {
      qos.transport().user_transports.push_back(udp);
    } else {
      auto guarded = std::make_shared<dds::GuardedTransportDescriptor>(udp);
      guarded->guard.receiver.secured = site != nullptr;
      qos.transport().user_transports.push_back(guarded);
    }
    if (site != nullptr)
      for (const auto& [property, value] : dds::security_properties(site->documents(), identity))
        qos.properties().properties().emplace_back(property, value);
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

void round_trip(benchmark::State& state, Protection protection) {
  fast_dds::deliver_by_transport();
  std::optional<bench::SecuritySite> made;
  if (protection == Protection::kSecured || protection == Protection::kRtpsSigned) {
    made.emplace("asking | there | back\necho | back | there\n", kDomain,
                 protection == Protection::kRtpsSigned);
    if (!made->made()) return state.SkipWithError("deploy/security/make failed");
  }
  const bench::SecuritySite* site = made ? &*made : nullptr;
  Returned returned;
  Side echo("echo", protection, site, "back", "there", [](Side& side) { side.send(); });
  Side asking("asking", protection, site, "there", "back", [&](Side&) { returned.add(); });
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
BENCHMARK_CAPTURE(round_trip, bare, Protection::kNone)->Name("round_trip/bare")->UseRealTime();
BENCHMARK_CAPTURE(round_trip, guarded, Protection::kGuarded)->Name("round_trip/guarded")->UseRealTime();
BENCHMARK_CAPTURE(round_trip, secured, Protection::kSecured)->Name("round_trip/secured")->UseRealTime();
BENCHMARK_CAPTURE(round_trip, rtps_signed, Protection::kRtpsSigned)
    ->Name("round_trip/rtps_signed")
    ->UseRealTime();

}  // namespace
}  // namespace phantom

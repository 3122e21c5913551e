#include "components/dds_recorder/dds_adapter.hpp"

#include <atomic>
#include <map>
#include <mutex>
#include <set>

#include "common/dds/cdr.hpp"
#include "common/dds/status_reporter.hpp"
#include "common/dds/topic_list.hpp"
#include "common/diagnostics/qos.hpp"
#include "common/observation/observer.hpp"
#include "common/observation/payload_reader.hpp"
#include "common/runtime/process.hpp"
#include "components/dds_recorder/dds_adapter_topics.hpp"

namespace phantom::dds_recorder {
namespace {

/// The subscription to one topic.
class Ear : public observation::PayloadListener {
 public:
  Ear(SampleQueue& queue, TopicNumber number) : queue_(queue), number_(number) {}
  void on_payload(const observation::Payload& payload) override {
    if (payload.bytes.empty()) return;  // end of an instance; a recording holds samples only
    SampleHead head;
    head.topic = number_;
    head.writer = payload.writer;
    head.sequence_number = payload.sequence_number;
    head.source_utc_ns = payload.source_ns;
    head.received_ns = payload.received_ns;
    if (!queue_.push({head, payload.bytes})) overflow_.fetch_add(1, std::memory_order_relaxed);
  }
  std::uint64_t overflow() const { return overflow_.load(std::memory_order_relaxed); }
  std::unique_ptr<observation::PayloadReader> reader;

 private:
  SampleQueue& queue_;
  TopicNumber number_;
  std::atomic<std::uint64_t> overflow_{0};
};

}  // namespace

struct DdsAdapter::Impl : observation::DiscoveryListener {
  Impl(const core::NetworkOptions& network, KeepsTopic keeps_topic, SampleQueue& to)
      : keeps(std::move(keeps_topic)),
        queue(to),
        partition(network.partition),
        participant("dds_recorder", network),
        status(participant) {
    for (const dds::TopicDescription* topic : dds::all_topics()) {
      if (keeps(topic->name)) fresh.push_back(topic_info(*topic));
      named.insert(topic->name);
    }
    observer = std::make_unique<observation::Observer>("dds_recorder", network, *this);
  }

  void on_participant(const diagnostics::ParticipantInfo& info, observation::Presence presence) override {
    const std::lock_guard lock(mutex);
    if (presence == observation::Presence::kAppeared || presence == observation::Presence::kChanged)
      graph.put(info);
  }
  void on_endpoint(const diagnostics::EndpointInfo& info, observation::Presence presence) override {
    if (!info.writer || presence != observation::Presence::kAppeared) return;
    const std::lock_guard lock(mutex);
    if (!named.insert(info.topic).second || !keeps(info.topic)) return;
    fresh.push_back(topic_info(info));
  }

  KeepsTopic keeps;
  SampleQueue& queue;
  const std::string partition;  // the cell's; empty: the whole domain
  mutable std::mutex mutex;     // guards graph, named, fresh
  diagnostics::Graph graph;
  std::set<std::string> named;
  std::vector<TopicInfo> fresh;
  dds::Participant participant;
  dds::StatusReporter status;
  std::map<TopicNumber, std::unique_ptr<Ear>> ears;
  std::unique_ptr<observation::Observer> observer;  // last: the other members outlive it
};

DdsAdapter::DdsAdapter(const core::NetworkOptions& network, KeepsTopic keeps, SampleQueue& queue)
    : impl_(std::make_unique<Impl>(network, std::move(keeps), queue)) {}

DdsAdapter::~DdsAdapter() { close_all(); }

void DdsAdapter::close_all() {
  for (auto& [number, ear] : impl_->ears) ear->reader.reset();
}

std::vector<TopicInfo> DdsAdapter::new_topics() {
  const std::lock_guard lock(impl_->mutex);
  return std::exchange(impl_->fresh, {});
}

bool DdsAdapter::open(const TopicInfo& topic, TopicNumber number, std::string& why) {
  auto ear = std::make_unique<Ear>(impl_->queue, number);
  Ear& hearing = *ear;
  observation::PayloadQos qos = reader_qos(topic);
  qos.partition = impl_->partition;
  impl_->ears[number] = std::move(ear);
  try {
    hearing.reader = std::make_unique<observation::PayloadReader>(
        impl_->observer->participant(), observation::PayloadTopic{topic.name, topic.type, topic.keyed}, qos,
        hearing);
  } catch (const dds::DdsError& problem) {
    why = problem.what();
    return false;
  }
  return true;
}

InputLosses DdsAdapter::losses(TopicNumber topic) const {
  const Ear& ear = *impl_->ears.at(topic);
  return {ear.overflow(), ear.reader ? ear.reader->lost() : 0, ear.reader ? ear.reader->rejected() : 0};
}

WriterInfo DdsAdapter::describe(const Guid& writer) const {
  const std::lock_guard lock(impl_->mutex);
  const diagnostics::ParticipantInfo* info = impl_->graph.participant(diagnostics::participant_of(writer));
  return info == nullptr ? WriterInfo{} : WriterInfo{info->name, info->host, info->process};
}

void DdsAdapter::publish_status(const core::Health& health) { impl_->status.publish(health); }

std::uint32_t send_mark(const core::NetworkOptions& network, const std::string& issuer, double limit_s) {
  dds::Participant participant("dds_recorder trigger", network);
  dds::Stamper stamper(participant);
  dds::Writer<msg::OperatorCommand> writer(participant, dds::kOperatorCommand);
  const core::Nanoseconds until_ns = core::monotonic_ns() + core::from_seconds(limit_s);
  const core::Nanoseconds least_ns =
      core::monotonic_ns() + core::kNsPerSecond;  // for recorders that are discovered a little later
  while (core::monotonic_ns() < (writer.matched() > 0 ? least_ns : until_ns)) {
    if (!runtime::sleep_unless_stopped(0.02)) return 0;
  }
  const std::uint32_t heard = writer.matched();
  msg::OperatorCommand command;
  command.stamp(stamper.next());
  command.kind(msg::COMMAND_MARK);
  command.issuer(issuer.substr(0, 64));
  if (heard > 0) writer.write(command);
  runtime::sleep_unless_stopped(0.3);  // time for reliable delivery to repeat a lost sample
  return heard;
}

}  // namespace phantom::dds_recorder

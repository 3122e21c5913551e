#include "components/dds_recorder/adapter/dds_adapter.hpp"

#include <atomic>
#include <map>
#include <mutex>

#include "common/core/utf8.hpp"
#include "common/dds/endpoints/cdr.hpp"
#include "common/dds/endpoints/topic_list.hpp"
#include "common/diagnostics/qos.hpp"
#include "common/messages/codecs/teleoperation_codec.hpp"
#include "common/messages/publisher.hpp"
#include "common/messages/status_reporter.hpp"
#include "common/observation/observer.hpp"
#include "common/observation/payload_reader.hpp"
#include "common/runtime/process/process.hpp"
#include "components/dds_recorder/adapter/dds_adapter_topics.hpp"
#include "components/dds_recorder/adapter/known_topics.hpp"
#include "components/dds_recorder/processes.hpp"

namespace phantom::dds_recorder {
namespace {

/// The subscription to one topic.
class Subscription : public observation::PayloadListener {
 public:
  Subscription(SampleQueue& queue, TopicNumber number) : queue_(queue), number_(number) {}
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
      known.add_own(topic->name);
    }
    observer = std::make_unique<observation::Observer>("dds_recorder", network, *this);
    status.count_refusals_of(observer->participant());
  }

  void on_participant(const diagnostics::ParticipantInfo& info, diagnostics::Presence presence) override {
    const std::lock_guard lock(mutex);
    if (presence == diagnostics::Presence::kAppeared || presence == diagnostics::Presence::kChanged) {
      processes.put(info);
    } else {
      processes.leave(info.guid);
    }
  }
  void on_endpoint(const diagnostics::EndpointInfo& info, diagnostics::Presence presence) override {
    if (!info.writer || presence != diagnostics::Presence::kAppeared) return;
    const std::lock_guard lock(mutex);
    processes.put(info);
    if (keeps(info.topic) && known.is_fresh(info.topic)) fresh.push_back(topic_info(info));
  }

  KeepsTopic keeps;
  SampleQueue& queue;
  const std::string partition;  // the cell's; empty: the whole domain
  mutable std::mutex mutex;     // guards processes, known, fresh
  Processes processes;
  KnownTopics known;
  std::vector<TopicInfo> fresh;
  dds::Participant participant;
  messages::StatusReporter status;
  std::map<TopicNumber, std::unique_ptr<Subscription>> subscriptions;
  std::unique_ptr<observation::Observer> observer;  // last: the other members outlive it
};

DdsAdapter::DdsAdapter(const core::NetworkOptions& network, KeepsTopic keeps, SampleQueue& queue)
    : impl_(std::make_unique<Impl>(network, std::move(keeps), queue)) {}

DdsAdapter::~DdsAdapter() { close_all(); }

void DdsAdapter::close_all() {
  for (auto& [number, subscription] : impl_->subscriptions) subscription->reader.reset();
}

std::vector<TopicInfo> DdsAdapter::new_topics() {
  const std::lock_guard lock(impl_->mutex);
  return std::exchange(impl_->fresh, {});
}

bool DdsAdapter::open(const TopicInfo& topic, TopicNumber number, std::string& why) {
  auto& subscription = *(impl_->subscriptions[number] = std::make_unique<Subscription>(impl_->queue, number));
  diagnostics::EndpointQos qos = reader_qos(topic);
  if (!impl_->partition.empty()) qos.partitions = {impl_->partition};
  try {
    subscription.reader = std::make_unique<observation::PayloadReader>(
        impl_->observer->participant(), observation::PayloadTopic{topic.name, topic.type, topic.keyed}, qos,
        subscription, topic.durable ? 0 : 1024);  // 0: all, so that a late joiner's burst is complete
  } catch (const dds::DdsError& problem) {
    why = problem.what();
    return false;
  }
  return true;
}

TopicLosses DdsAdapter::losses(TopicNumber topic) const {
  const Subscription& subscription = *impl_->subscriptions.at(topic);
  TopicLosses losses{.overflow = subscription.overflow()};
  if (subscription.reader) losses.dds_lost = subscription.reader->lost();
  if (subscription.reader) losses.dds_rejected = subscription.reader->rejected();
  return losses;
}

WriterInfo DdsAdapter::describe(const Guid& writer) const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->processes.describe(writer);
}

std::uint64_t DdsAdapter::topics_left_out() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->known.left_out();
}

void DdsAdapter::publish_status(const core::Health& health) { impl_->status.publish(health); }

std::uint32_t send_mark(const core::NetworkOptions& network, const std::string& issuer, double limit_s) {
  dds::Participant participant("dds_recorder trigger", network);
  messages::Publisher<messages::OperatorCommand> requests(participant, dds::kRecordingRequest);
  const core::Nanoseconds until_ns = core::monotonic_ns() + core::from_seconds(limit_s);
  const core::Nanoseconds least_ns =
      core::monotonic_ns() + core::kNsPerSecond;  // for recorders that are discovered a little later
  while (core::monotonic_ns() < (requests.matched() > 0 ? least_ns : until_ns)) {
    if (!runtime::sleep_unless_stopped(0.02)) return 0;
  }
  const std::uint32_t matched = requests.matched();
  if (matched > 0) requests.publish({.kind = teleop::CommandKind::kMark, .issuer = issuer});
  runtime::sleep_unless_stopped(0.3);  // time for reliable delivery to repeat a lost sample
  return matched;
}

std::vector<std::string> unknown_names(const std::vector<std::string>& names) {
  std::vector<std::string> unknown;
  for (const std::string& name : names) {
    const auto topics = dds::all_topics();
    const bool known =
        std::ranges::any_of(topics, [&](const dds::TopicDescription* topic) { return topic->name == name; });
    if (name.find_first_of("*?[!") == std::string::npos && !known) unknown.push_back(name);
  }
  return unknown;
}

}  // namespace phantom::dds_recorder

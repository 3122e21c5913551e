#include "components/dds_spy/dds_adapter.hpp"

#include <nlohmann/json.hpp>

#include "common/dds/endpoints/topic_list.hpp"
#include "common/observation/contract_qos.hpp"
#include "common/observation/observer.hpp"
#include "common/observation/payload_reader.hpp"
#include "common/observation/type_catalogue.hpp"
#include "common/ros2/introspection.hpp"
#include "components/dds_spy/foreign_topics.hpp"

namespace phantom::dds_spy {
namespace {

using diagnostics::Guid;
using Json = nlohmann::ordered_json;

/// Returns the stamp of a decoded sample, or none if it has no valid one.
std::optional<SampleStamp> stamp_of(const Json& sample) {
  const auto found = sample.find("stamp");
  if (found == sample.end() || !found->is_object()) return std::nullopt;
  const auto number = [&](const char* name) { return found->value(name, Json(nullptr)); };
  const Json sequence = number("sequence_number"), monotonic = number("monotonic_ns"), utc = number("utc_ns"),
             session = number("session");
  if (!sequence.is_number_integer() || !monotonic.is_number_integer() || !utc.is_number_integer() ||
      !session.is_number_integer())
    return std::nullopt;
  if (sequence == 0) return std::nullopt;
  return SampleStamp{sequence, monotonic, utc, session};
}

/// Returns the description of a type of the project's, of one that its owner described, or of ROS 2's.
diagnostics::TypePtr description_of(const std::string& type) {
  const auto known = observation::type_of(type);
  return known ? known : ros2::type_tree(type);
}

}  // namespace

const std::map<std::string, TopicContract>& contracts() {
  static const auto all = [] {
    std::map<std::string, TopicContract> map;
    for (const dds::TopicDescription* topic : dds::all_topics()) {
      map[topic->name] = {topic->type_name, observation::contract_qos(topic->qos)};
    }
    return map;
  }();
  return all;
}

struct DdsAdapter::Impl : observation::DiscoveryListener {
  /// A topic's reader and the plan by which it was created.
  struct TopicReader : observation::PayloadListener {
    TopicReader(Impl& of, std::string name, const ReadingPlan& for_plan)
        : impl(of), topic(std::move(name)), plan(for_plan), type(description_of(for_plan.type)) {}
    void on_payload(const observation::Payload& payload) override { impl.take(*this, payload); }
    void on_liveliness(const Guid& writer, bool alive) override {
      const std::lock_guard lock(impl.mutex);
      impl.view.on_liveliness(writer, alive, core::utc_ns());
    }

    Impl& impl;
    const std::string topic;
    const ReadingPlan plan;
    const diagnostics::TypePtr type;  ///< null: neither the project's nor described
    std::unique_ptr<observation::PayloadReader> reader;
  };

  Impl(const core::NetworkOptions& network, const Reading& what, SystemView& into, OnSample then)
      : reading(what),
        view(into),
        on_sample(std::move(then)),
        observer("dds_spy", network, *this, what.ask_types) {}

  const Reading reading;
  SystemView& view;
  const OnSample on_sample;
  std::mutex mutex;
  observation::Observer observer;
  std::map<std::string, std::unique_ptr<TopicReader>>
      readers;            // by topic; used by the thread of follow_writers() only
  ForeignTopics foreign;  // likewise: of these readers

  void on_participant(const diagnostics::ParticipantInfo& participant,
                      diagnostics::Presence presence) override {
    const std::lock_guard lock(mutex);
    view.on_participant(participant, presence, core::utc_ns());
  }
  void on_endpoint(const diagnostics::EndpointInfo& endpoint, diagnostics::Presence presence) override {
    const std::lock_guard lock(mutex);
    view.on_endpoint(endpoint, presence, core::utc_ns());
  }

  // The participant names its own nodes alone. Returns the form of the message; null: it has none.
  diagnostics::TypePtr take_nodes(const observation::Payload& payload) {
    auto read = ros2::read_graph(payload.bytes);
    if (!read) return nullptr;
    const std::lock_guard lock(mutex);
    if (read->participant == diagnostics::participant_of(payload.writer))
      view.on_nodes(read->participant, std::move(read->nodes));
    return read->form;
  }

  bool keeps(const std::string& topic) const { return reading.read_topics && reading.topics.keeps(topic); }

  /// A pattern may be that of the whole key, "component_name=slave_io, host=desk", or of one of its parts.
  bool keeps_instance(const std::string& instance) const {
    if (reading.instances.keeps(instance)) return true;
    if (reading.instances.excludes()) return false;
    for (std::size_t from = 0; from < instance.size();) {
      const std::size_t end = std::min(instance.find(", ", from), instance.size());
      if (reading.instances.keeps(instance.substr(from, end - from))) return true;
      from = end + 2;
    }
    return false;
  }

  void take(const TopicReader& from, const observation::Payload& payload) {
    diagnostics::TypePtr type = from.type;
    if (from.topic == ros2::kGraphTopic) {
      if (const auto form = take_nodes(payload)) type = form;
      if (!keeps(from.topic)) return;
    }
    ReceivedSample sample;
    sample.topic = from.topic;
    sample.writer = payload.writer;
    sample.gone = payload.instance != observation::InstanceState::kAlive;
    sample.facts.received_ns = payload.received_ns;
    sample.facts.received_utc_ns = payload.received_utc_ns;
    sample.facts.source_ns = payload.source_ns;
    sample.facts.sequence_number = payload.sequence_number;
    sample.facts.octets = payload.bytes.size();
    if (type && !sample.gone) {
      auto decoded = diagnostics::decode(*type, payload.bytes, reading.decode);
      if (decoded) {
        sample.instance = diagnostics::instance_name(*type, *decoded);
        sample.facts.stamp = stamp_of(*decoded);
        sample.content = std::move(*decoded);
      } else {
        sample.problem = decoded.status().message();
      }
    }
    if (!sample.content) sample.octets = diagnostics::octets_text(payload.bytes, reading.decode.most_octets);
    const std::lock_guard lock(mutex);
    if (!reading.writers.keeps_all() && !reading.writers.keeps(name_of_writer(payload.writer))) return;
    if (!sample.instance.empty() && !keeps_instance(sample.instance)) return;
    sample.facts.same_host = on_this_host(payload.writer);
    view.on_sample(sample);
    if (on_sample && !sample.gone) on_sample(sample);
  }

  std::string name_of_writer(const Guid& writer) const {
    const auto* participant = view.graph().participant(writer);
    return participant == nullptr ? std::string() : participant->name;
  }

  // The GUID prefix has only a short hash of the host, so that the machines must agree, too, where both
  // announce theirs.
  bool on_this_host(const Guid& writer) const {
    const auto* other = view.graph().participant(writer);
    const std::string& mine = observer.machine();
    return diagnostics::same_host(writer, observer.guid()) &&
           (other == nullptr || other->machine.empty() || mine.empty() || other->machine == mine);
  }

  std::map<std::string, ReadingPlan> plans() {
    const std::lock_guard lock(mutex);
    std::map<std::string, std::vector<const diagnostics::EndpointInfo*>> writers;
    for (const auto& [guid, endpoint] : view.graph().endpoints()) {
      if (endpoint.writer && (keeps(endpoint.topic) || endpoint.topic == ros2::kGraphTopic))
        writers[endpoint.topic].push_back(&endpoint);
    }
    std::map<std::string, ReadingPlan> made;
    for (const auto& [topic, list] : writers) {
      // Who came before names its nodes to late joiners.
      const auto options =
          topic == ros2::kGraphTopic ? ReadingOptions{.reliable = true, .history = true} : reading.options;
      if (const auto plan = plan_reading(list, options)) made[topic] = *plan;
    }
    return made;
  }

  void make_reader(const std::string& topic, const ReadingPlan& plan) {
    readers.erase(topic);
    auto made = std::make_unique<TopicReader>(*this, topic, plan);
    {
      const std::lock_guard lock(mutex);
      view.on_reader_made(topic);
    }
    auto& kept = *(readers[topic] = std::move(made));
    kept.reader = std::make_unique<observation::PayloadReader>(
        observer.participant(), observation::PayloadTopic{topic, plan.type, plan.keyed}, plan.qos, kept);
  }
};

DdsAdapter::DdsAdapter(const core::NetworkOptions& network, const Reading& reading, SystemView& view,
                       OnSample on_sample)
    : impl_(std::make_unique<Impl>(network, reading, view, std::move(on_sample))) {}

DdsAdapter::~DdsAdapter() { impl_->readers.clear(); }

std::unique_lock<std::mutex> DdsAdapter::lock() { return std::unique_lock(impl_->mutex); }

std::vector<std::string> DdsAdapter::follow_writers() {
  std::vector<std::string> problems;
  impl_->observer.participant().log_refused_datagrams();
  const auto plans = impl_->plans();
  const auto is_written = [&](const std::string& topic) { return plans.contains(topic); };
  const auto drop = [&](const std::string& topic) { impl_->readers.erase(topic); };
  for (const auto& [topic, plan] : plans) {
    const auto known = impl_->readers.find(topic);
    if (known != impl_->readers.end() && known->second->plan == plan) continue;
    if (!contracts().contains(topic) && !impl_->foreign.admit(topic, is_written, drop)) continue;
    try {
      impl_->make_reader(topic, plan);
    } catch (const dds::DdsError& problem) {
      problems.emplace_back(problem.what());  // stays without reader until its plan changes
    }
  }
  if (const std::string problem = impl_->foreign.take_problem(); !problem.empty())
    problems.push_back(problem);
  return problems;
}

}  // namespace phantom::dds_spy

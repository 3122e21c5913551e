#include "components/dds_recorder/adapter/dds_adapter_topics.hpp"

#include <charconv>

#include "common/dds/endpoints/cdr.hpp"
#include "common/observation/contract_qos.hpp"
#include "common/ros2/message_types.hpp"
#include "components/dds_recorder/idl_text.hpp"

namespace phantom::dds_recorder {
namespace {

std::string number_or_none(std::int64_t ns) {
  return ns == diagnostics::kInfinite_ns ? "none" : std::to_string(ns);
}

void describe_type(TopicInfo& info) {
  info.schema = idl_of(info.type);
  info.schema_encoding = info.schema.empty() ? "" : kIdlEncoding;
  if (const auto* type = ros2::find_message_type(info.type); type != nullptr) {
    info.schema = type->definition;
    info.schema_encoding = "ros2msg";
  }
}

void describe_qos(TopicInfo& info, const diagnostics::EndpointQos& qos, int depth) {
  info.durable = qos.durability != diagnostics::Durability::kVolatile;
  info.qos = {{"reliability", to_string(qos.reliability)},
              {"durability", to_string(qos.durability)},
              {"depth", std::to_string(depth)},
              {"deadline_ns", number_or_none(qos.deadline_ns)},
              {"liveliness", to_string(qos.liveliness)},
              {"lease_ns", number_or_none(qos.lease_ns)},
              {"lifespan_ns", number_or_none(qos.lifespan_ns)}};
}

std::string policy(const TopicInfo& topic, const char* name) {
  for (const auto& [key, value] : topic.qos) {
    if (key == name) return value;
  }
  return "";
}

std::int64_t nanoseconds(const TopicInfo& topic, const char* name) {
  const std::string text = policy(topic, name);
  std::int64_t value = diagnostics::kInfinite_ns;
  const auto parsed = std::from_chars(text.data(), text.data() + text.size(), value);
  return parsed.ec == std::errc() && value > 0 ? value : diagnostics::kInfinite_ns;
}

template <class Value>
Value value_named(const std::string& text, std::initializer_list<Value> values, Value fallback) {
  for (const Value value : values) {
    if (text == to_string(value)) return value;
  }
  return fallback;
}

}  // namespace

TopicInfo topic_info(const dds::TopicDescription& topic) {
  TopicInfo info{.name = topic.name, .type = topic.type_name, .keyed = dds::CdrCodec(topic).keyed()};
  describe_type(info);
  describe_qos(info, observation::contract_qos(topic.qos), topic.qos.history_depth);
  return info;
}

TopicInfo topic_info(const diagnostics::EndpointInfo& writer) {
  TopicInfo info{.name = writer.topic, .type = writer.type, .keyed = writer.keyed};
  describe_type(info);
  describe_qos(info, writer.qos, 1);
  return info;
}

diagnostics::EndpointQos reader_qos(const TopicInfo& topic) {
  diagnostics::EndpointQos qos;
  qos.reliability = writer_qos(topic).reliability;
  if (topic.durable) qos.durability = diagnostics::Durability::kTransientLocal;
  return qos;
}

diagnostics::EndpointQos writer_qos(const TopicInfo& topic) {
  // For the project's own topics the present contract holds, because present readers request it.
  if (const auto* known = dds::topic_of_type(topic.type)) return observation::contract_qos(known->qos);
  using namespace diagnostics;
  EndpointQos qos;
  qos.reliability = value_named(policy(topic, "reliability"),
                                {Reliability::kBestEffort, Reliability::kReliable}, Reliability::kReliable);
  qos.durability = value_named(
      policy(topic, "durability"),
      {Durability::kVolatile, Durability::kTransientLocal, Durability::kTransient, Durability::kPersistent},
      Durability::kVolatile);
  qos.liveliness =
      value_named(policy(topic, "liveliness"),
                  {Liveliness::kAutomatic, Liveliness::kManualByParticipant, Liveliness::kManualByTopic},
                  Liveliness::kAutomatic);
  qos.deadline_ns = nanoseconds(topic, "deadline_ns");
  qos.lease_ns = nanoseconds(topic, "lease_ns");
  qos.lifespan_ns = nanoseconds(topic, "lifespan_ns");
  return qos;
}

int history_depth(const TopicInfo& topic) {
  if (const auto* known = dds::topic_of_type(topic.type)) return known->qos.history_depth;
  return topic.durable ? 1 : 64;
}

}  // namespace phantom::dds_recorder

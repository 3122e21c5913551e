#pragma once

#include <string>
#include <utility>

#include "common/ros2/node.hpp"
#include "common/ros2/plausible.hpp"
#include "fast_dds/type_support.hpp"

namespace phantom::ros2 {

/// Returns the USER_DATA of an endpoint: the hash of its type, "typehash=RIHS01_…;"; empty if it is unknown.
std::string hash_user_data(const std::string& dds_type_name);

/// A topic of ROS 2 with its DDS names. `PubSubType`: the generated class of the message's type. Of messages
/// that are not plausible nothing is decoded.
template <class PubSubType>
class Topic {
 public:
  using Message = typename PubSubType::type;

  /// `name` as ROS 2 has it, without the first slash: "joint_states".
  Topic(const std::string& name, const dds::QosContract& qos)
      : name_("rt/" + name),
        type_name_(make().get_type_name()),
        user_data_(hash_user_data(type_name_)),
        spec_{{.name = name_.c_str(),
               .type_name = type_name_.c_str(),
               .qos = qos,
               .make_type = make,
               .foreign = true,
               .user_data = user_data_.c_str()}} {}
  Topic(Topic&&) = delete;
  const dds::TopicSpec<Message>& spec() const { return spec_; }

 private:
  static eprosima::fastdds::dds::TypeSupport make() {
    eprosima::fastdds::dds::TypeSupport type(new fast_dds::Screened<PubSubType, is_plausible>());
    fast_dds::announce_name_only(*type);
    return type;
  }

  std::string name_, type_name_, user_data_;
  dds::TopicSpec<Message> spec_;
};

/// A topic's name and QoS, for publishers of its type.
template <class PubSubType>
struct TopicName {
  std::string name;
  dds::QosContract qos;
};

/// Publishes a message type on a topic of ROS 2. Thread-safe; may block as dds::Writer::write().
template <class PubSubType>
class Publisher {
 public:
  using Message = typename PubSubType::type;

  /// Throws dds::DdsError.
  Publisher(Node& node, const std::string& topic, const dds::QosContract& qos)
      : topic_(topic, qos), writer_(node.participant(), topic_.spec()) {
    node.add_writer(writer_.guid());
  }
  Publisher(Node& node, const TopicName<PubSubType>& topic) : Publisher(node, topic.name, topic.qos) {}
  bool publish(const Message& message) { return writer_.write(message); }
  std::uint32_t matched() const { return writer_.matched(); }

 private:
  Topic<PubSubType> topic_;
  dds::Writer<Message> writer_;
};

/// Receives a message type from a topic of ROS 2, as dds::Reader does; messages that are not plausible are as
/// if they had not come.
template <class PubSubType>
class Subscription {
 public:
  using Message = typename PubSubType::type;

  /// Throws dds::DdsError.
  template <class Callback>
  Subscription(Node& node, const std::string& topic, const dds::QosContract& qos, Callback on_message)
      : topic_(topic, qos), reader_(node.participant(), topic_.spec(), std::move(on_message)) {
    node.add_reader(reader_.guid());
  }
  std::uint32_t matched() const { return reader_.matched(); }

 private:
  Topic<PubSubType> topic_;
  dds::Reader<Message> reader_;
};

}  // namespace phantom::ros2

#include "common/ros2/node.hpp"

#include <algorithm>

#include "common/ros2/endpoint.hpp"
#include "common/ros2/introspection.hpp"
#include "common/ros2/message_types.hpp"
#include "ros2_idl/rmw_dds_commonPubSubTypes.hpp"
#include "ros2_idl/rmw_dds_common_humblePubSubTypes.hpp"

namespace phantom::ros2 {
namespace {

constexpr const char* kGraphType = "rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_";

core::NetworkOptions network_of(const NodeOptions& options) {
  core::NetworkOptions network;
  network.domain = options.domain;
  network.interfaces = options.interfaces;
  network.initial_peers = options.initial_peers;
  network.user_data = "enclave=/;";
  return network;
}

// The graph of this node, in the messages of either form.
template <class Info, class NodeInfo, class Gid>
Info graph_of(const std::string& name, const dds::Guid& participant, const std::vector<dds::Guid>& writers,
              const std::vector<dds::Guid>& readers) {
  const auto gid_of = [](const dds::Guid& guid) {
    Gid gid;
    gid.data().fill(0);
    std::copy(guid.begin(), guid.end(), gid.data().begin());
    return gid;
  };
  NodeInfo node;
  node.node_namespace("/");
  node.node_name(name);
  for (const dds::Guid& guid : writers) node.writer_gid_seq().push_back(gid_of(guid));
  for (const dds::Guid& guid : readers) node.reader_gid_seq().push_back(gid_of(guid));
  Info info;
  info.gid(gid_of(participant));
  info.node_entities_info_seq().push_back(node);
  return info;
}

template <class PubSubType>
eprosima::fastdds::dds::TypeSupport graph_type() {
  eprosima::fastdds::dds::TypeSupport type(new PubSubType());
  fast_dds::announce_name_only(*type);
  return type;
}

namespace since_iron = rmw_dds_common::msg::dds_;
namespace humble = rmw_dds_common_humble::msg::dds_;

}  // namespace

std::string hash_user_data(const std::string& dds_type_name) {
  const MessageType* type = find_message_type(dds_type_name);
  return type == nullptr ? "" : "typehash=" + std::string(type->hash) + ";";
}

struct Node::GraphWriter {
  GraphWriter(dds::Participant& participant, Graph form)
      : of_humble(form == Graph::kHumble),
        user_data(of_humble ? "" : hash_user_data(kGraphType)),
        topic{.name = kGraphTopic,
              .type_name = kGraphType,
              .qos = kLatched,
              .make_type = of_humble ? graph_type<humble::ParticipantEntitiesInfo_PubSubType>
                                     : graph_type<since_iron::ParticipantEntitiesInfo_PubSubType>,
              .foreign = true,
              .user_data = user_data.c_str()},
        participant_guid(dds::guid_of(participant)),
        writer(participant, topic) {}

  void send(const std::string& name, const std::vector<dds::Guid>& writers,
            const std::vector<dds::Guid>& readers) {
    if (of_humble) {
      auto info = graph_of<humble::ParticipantEntitiesInfo_, humble::NodeEntitiesInfo_, humble::Gid_>(
          name, participant_guid, writers, readers);
      writer.write(&info);
    } else {
      auto info =
          graph_of<since_iron::ParticipantEntitiesInfo_, since_iron::NodeEntitiesInfo_, since_iron::Gid_>(
              name, participant_guid, writers, readers);
      writer.write(&info);
    }
  }

  bool of_humble;
  std::string user_data;
  dds::TopicDescription topic;
  dds::Guid participant_guid;
  dds::RawWriter writer;
};

Node::Node(const NodeOptions& options)
    : name_(options.name), participant_(options.name, network_of(options)) {
  if (options.graph == Graph::kNone) return;
  graph_ = std::make_unique<GraphWriter>(participant_, options.graph);
  graph_->send(name_, writers_, readers_);
}

Node::~Node() = default;

void Node::add(std::vector<dds::Guid>& endpoints, const dds::Guid& guid) {
  const std::lock_guard lock(mutex_);
  endpoints.push_back(guid);
  if (graph_) graph_->send(name_, writers_, readers_);
}
void Node::add_writer(const dds::Guid& guid) { add(writers_, guid); }
void Node::add_reader(const dds::Guid& guid) { add(readers_, guid); }

}  // namespace phantom::ros2

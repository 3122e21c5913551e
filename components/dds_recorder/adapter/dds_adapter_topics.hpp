#pragma once

// How topics are described, and the QoS with which they are read and written. Part of the DDS adapter.

#include "common/dds/endpoints/topics.hpp"
#include "common/diagnostics/graph.hpp"
#include "components/dds_recorder/sample.hpp"

namespace phantom::dds_recorder {

/// Describes a topic of the project by its contract.
TopicInfo topic_info(const dds::TopicDescription& topic);
/// Describes any topic as one of its writers announces it; adds the type's description if it is the
/// project's.
TopicInfo topic_info(const diagnostics::EndpointInfo& writer);
/// Returns a QoS for a reader that matches the topic's writers and loses as few samples as possible.
diagnostics::EndpointQos reader_qos(const TopicInfo& topic);
/// Returns the QoS of a writer that replaces the recorded ones; history_depth() is the number of samples per
/// instance that it keeps.
diagnostics::EndpointQos writer_qos(const TopicInfo& topic);
int history_depth(const TopicInfo& topic);

}  // namespace phantom::dds_recorder

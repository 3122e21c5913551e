#pragma once

// How topics are described and heard. Part of the DDS adapter.

#include "common/dds/topics.hpp"
#include "common/diagnostics/graph.hpp"
#include "common/observation/payload_reader.hpp"
#include "components/dds_recorder/sample.hpp"

namespace phantom::dds_recorder {

/// Of the project, by its contract.
TopicInfo topic_info(const dds::TopicDescription& topic);
/// Of anybody, as one of its writers announces it. A type of the project gets its description.
TopicInfo topic_info(const diagnostics::EndpointInfo& writer);
/// What a reader asks for that matches the topic's writers and loses as little as can be.
observation::PayloadQos reader_qos(const TopicInfo& topic);
/// What a writer offers who takes the place of those that were recorded, and how many samples of an instance
/// it keeps.
diagnostics::EndpointQos writer_qos(const TopicInfo& topic);
int history_depth(const TopicInfo& topic);

}  // namespace phantom::dds_recorder

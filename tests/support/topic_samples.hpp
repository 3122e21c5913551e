#pragma once

#include <functional>
#include <string>

#include "common/dds/endpoints/topics.hpp"

namespace phantom::test {

/// Gives `use` a sample of the topic's type in which members of every kind differ from each other and from
/// their defaults, all within their ranges.
void with_sample(const dds::TopicDescription& topic, const std::function<void(void*)>& use);

}  // namespace phantom::test

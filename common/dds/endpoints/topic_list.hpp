#pragma once

#include <span>

#include "common/dds/endpoints/topics.hpp"

namespace phantom::dds {

/// Every topic of the system, in the order of the table in idl/README.md.
std::span<const TopicDescription* const> all_topics();

}  // namespace phantom::dds

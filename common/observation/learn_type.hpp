#pragma once

#include <string>

#include "fast_dds/types.hpp"

namespace phantom::observation {

/// Lets type_of() know a type that is not the project's by the description that its owner gave. Strangers
/// write descriptions: one with more than 4,096 members in all, 32 levels, 2^24 elements of arrays, or with
/// names that are none of IDL is not kept, which is logged; nor are more than 256, or a second by the same
/// name. Does nothing for an empty description. Private to common/observation. Thread-safe.
void learn_type(const std::string& type_name, const fast_dds::DescribedType& described);

}  // namespace phantom::observation

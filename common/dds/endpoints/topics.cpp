#include "common/dds/endpoints/topics.hpp"

#include <array>

#include "common/dds/endpoints/topic_list.hpp"
#include "fast_dds/type_support.hpp"
#include "phantom_contract/topic_types.inc"

namespace phantom::dds {
namespace {

using eprosima::fastdds::dds::TypeSupport;

// Type information is not announced: it makes other vendors refuse the endpoint, and a type object with a
// sequence of structs crashes participants that lack the type.
template <class PubSubType>
TypeSupport make_type() {
  TypeSupport type(new fast_dds::Refusing<PubSubType>());
  fast_dds::announce_name_only(*type);
  return type;
}

}  // namespace

#include "phantom_contract/topics.inc"

std::span<const TopicDescription* const> all_topics() { return kAllTopics; }

}  // namespace phantom::dds

#pragma once

// Fast DDS 2: the names that moved in version 3, as common/dds and common/observation use them. Only one of
// fast_dds_2 and fast_dds_3 is on the include path (common/dds/CMakeLists.txt).

#include <fastdds/rtps/common/Guid.h>
#include <fastdds/rtps/common/InstanceHandle.h>
#include <fastdds/rtps/common/Locator.h>
#include <fastdds/rtps/common/SerializedPayload.h>
#include <fastdds/rtps/common/Time_t.h>
#include <fastrtps/types/TypesBase.h>
#include <fastrtps/utils/IPLocator.h>

#include <cstdint>
#include <fastdds/rtps/common/LocatorList.hpp>
#include <fastdds/rtps/common/VendorId_t.hpp>

namespace phantom::fast_dds {

/// Names of RTPS, from the two namespaces in which version 2 has them.
namespace rtps {
using namespace eprosima::fastrtps::rtps;  // NOLINT(google-build-using-namespace)
using namespace eprosima::fastdds::rtps;   // NOLINT(google-build-using-namespace)
}  // namespace rtps

using Duration = eprosima::fastrtps::Duration_t;
inline const Duration& infinite() { return eprosima::fastrtps::c_TimeInfinite; }

/// A type by the description that its owner gave: version 2 asks nobody.
struct DescribedType {};
constexpr bool kAsksForTypes = false;

/// Whether profiles name times heartbeat_period; else heartbeatPeriod.
constexpr bool kTimesInSnakeCase = false;

/// Returns whether Fast DDS has done what it was asked for.
inline bool ok(const eprosima::fastrtps::types::ReturnCode_t& code) {
  return code == eprosima::fastrtps::types::ReturnCode_t::RETCODE_OK;
}
/// The same of what DataWriter::write() returns.
inline bool ok(bool done) { return done; }

}  // namespace phantom::fast_dds

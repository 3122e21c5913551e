#pragma once

// Fast DDS 3: the names that moved since version 2, as common/dds and common/observation use them. Only one
// of fast_dds_2 and fast_dds_3 is on the include path (common/dds/CMakeLists.txt).

#include <cstdint>
#include <fastdds/dds/core/ReturnCode.hpp>
#include <fastdds/dds/core/Time_t.hpp>
#include <fastdds/dds/xtypes/type_representation/TypeObject.hpp>
#include <fastdds/rtps/common/Guid.hpp>
#include <fastdds/rtps/common/InstanceHandle.hpp>
#include <fastdds/rtps/common/Locator.hpp>
#include <fastdds/rtps/common/LocatorList.hpp>
#include <fastdds/rtps/common/SerializedPayload.hpp>
#include <fastdds/rtps/common/VendorId_t.hpp>
#include <fastdds/utils/IPLocator.hpp>

namespace phantom::fast_dds {

namespace rtps = eprosima::fastdds::rtps;

using Duration = eprosima::fastdds::dds::Duration_t;
inline const Duration& infinite() { return eprosima::fastdds::dds::c_TimeInfinite; }

/// A type by the description that its owner gave.
using DescribedType = eprosima::fastdds::dds::xtypes::TypeIdentifier;
constexpr bool kAsksForTypes = true;

/// Whether profiles name times heartbeat_period; else heartbeatPeriod.
constexpr bool kTimesInSnakeCase = true;

/// Returns whether Fast DDS has done what it was asked for; version 3 tells so of DataWriter::write(), too.
inline bool ok(eprosima::fastdds::dds::ReturnCode_t code) {
  return code == eprosima::fastdds::dds::RETCODE_OK;
}

}  // namespace phantom::fast_dds

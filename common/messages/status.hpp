#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/core/health.hpp"
#include "common/core/sample_id.hpp"

namespace phantom::messages {

/// Topic component_status: the health of one component, and the DDS statistics of its endpoints.
struct ComponentStatus : core::Health {
  core::SampleId stamp;
  std::string component, host;
  std::uint32_t process_id = 0;
  std::vector<core::EndpointStatistics> topics;
};

}  // namespace phantom::messages

#pragma once

#include <cstdint>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <tuple>
#include <vector>

#include "components/dds_spy/events.hpp"

namespace phantom::dds_spy {

/// What the components tell of themselves (topic component_status): a change of state, and counts of what DDS
/// told their own endpoints. These see what an onlooker's reader cannot: whether a component missed a
/// deadline, not whether the spy did.
class StatusWatch {
 public:
  /// Events of a decoded phantom::msg::ComponentStatus, without time. What is not shaped as one gives none.
  std::vector<Event> take(const nlohmann::ordered_json& status);

 private:
  std::map<std::string, std::string> states_;  // by component and host
  std::map<std::tuple<std::string, std::string, bool, std::string>, std::uint64_t>
      counters_;  // … topic, writer, name
};

}  // namespace phantom::dds_spy

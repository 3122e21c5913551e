#pragma once

#include <cstdint>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <tuple>
#include <vector>

#include "components/dds_spy/events.hpp"

namespace phantom::dds_spy {

/// Finds events in component_status: changes of a component's state, and of the DDS counts of its own
/// endpoints. An observer's reader cannot see the latter: whether a component, and not the spy, missed a
/// deadline.
class StatusWatch {
 public:
  /// Returns the events of a decoded phantom::msg::ComponentStatus, without time; none for any other content.
  std::vector<Event> take(const nlohmann::ordered_json& status);

 private:
  std::map<std::string, std::string> states_;  // by component and host
  std::map<std::tuple<std::string, std::string, bool, std::string>, std::uint64_t>
      counters_;  // by component and host, topic, writer, name
};

}  // namespace phantom::dds_spy

#pragma once

#include <cstdint>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <tuple>
#include <vector>

#include "common/core/recent_map.hpp"
#include "components/dds_spy/events.hpp"

namespace phantom::dds_spy {

/// Finds events in component_status: changes of a component's state, of the DDS counts of its own
/// endpoints, and of the datagrams that it refused. An observer's reader cannot see the latter: whether a
/// component, and not the spy, missed a deadline.
class StatusWatch {
 public:
  /// Returns the events of a decoded phantom::msg::ComponentStatus, without time; none for any other content.
  std::vector<Event> take(const nlohmann::ordered_json& status);

 private:
  static constexpr std::size_t kMax = 256;  // components that are remembered
  using Counters =
      std::map<std::tuple<std::string, bool, std::string>, std::uint64_t>;  // topic, writer, name
  struct Known {
    std::string state;
    Counters counters;
  };
  static void add_refused_datagrams(const std::string& who, const nlohmann::ordered_json& status,
                                    const Known& known, bool first_look, Counters& counters,
                                    std::vector<Event>& events);

  core::RecentMap<std::string, Known> known_{kMax};  // by component and host
};

}  // namespace phantom::dds_spy

#pragma once

#include <string_view>

namespace phantom::fast_dds {

/// Returns whether a thread of that name is one of Fast DDS's. Version 3 names its threads itself:
/// "dds.ev.0", "dds.udp.7411".
inline bool is_own_thread(std::string_view name, std::string_view /*inherited*/) {
  return name.substr(0, 4) == "dds.";
}

}  // namespace phantom::fast_dds

#pragma once

#include <string_view>

namespace phantom::fast_dds {

/// Returns whether a thread of that name is one of Fast DDS's. Version 2 does not name its threads: each has
/// the name of the one that started it, `inherited`.
inline bool is_own_thread(std::string_view name, std::string_view inherited) { return name == inherited; }

}  // namespace phantom::fast_dds

#pragma once

#include "common/runtime/config_reader.hpp"
#include "common/teleop/link_state.hpp"

namespace phantom::runtime {

/// The keys of section `link` that master and slave have in common, with LinkTiming's defaults. Throws
/// ConfigError.
teleop::LinkTiming read_link(const ConfigReader& section);

}  // namespace phantom::runtime

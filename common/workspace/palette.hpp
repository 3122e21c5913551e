#pragma once

#include <vector>

#include "common/core/status.hpp"

namespace phantom::workspace {

/// Checks whether `palette_Pa_s_per_m` can be a workspace's palette: 1 to 256 finite entries, the first 0,
/// strictly rising.
core::Status check_palette(const std::vector<float>& palette_Pa_s_per_m);

}  // namespace phantom::workspace

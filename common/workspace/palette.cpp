#include "common/workspace/palette.hpp"

#include <cmath>
#include <string>

namespace phantom::workspace {

core::Status check_palette(const std::vector<float>& palette_Pa_s_per_m) {
  const auto& palette = palette_Pa_s_per_m;
  if (palette.empty() || palette.size() > 256) {
    return core::Status::invalid_argument("palette: has " + std::to_string(palette.size()) +
                                          " values of viscosity; allowed: 1 to 256");
  }
  if (palette.front() != 0.0F)
    return core::Status::invalid_argument("palette: does not begin with 0, free space");
  for (std::size_t i = 1; i < palette.size(); ++i) {
    if (!std::isfinite(palette[i]) || palette[i] <= palette[i - 1]) {
      return core::Status::invalid_argument("palette: does not rise at code " + std::to_string(i));
    }
  }
  return core::Status::ok();
}

}  // namespace phantom::workspace

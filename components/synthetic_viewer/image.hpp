#pragma once

#include <cstdint>
#include <vector>

namespace phantom::synthetic_viewer {

/// A picture: rows from top to bottom, three bytes per pixel in the order blue, green, red, no padding.
struct Image {
  int width_px = 0;
  int height_px = 0;
  std::vector<std::uint8_t> bgr;

  const std::uint8_t* at(int x, int y) const {
    return &bgr[3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(width_px) +
                     static_cast<std::size_t>(x))];
  }
};

}  // namespace phantom::synthetic_viewer

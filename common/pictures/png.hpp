#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace phantom::pictures {

/// Encodes a picture as a PNG file and returns its bytes. `bgr` holds rows from the top, `stride` bytes
/// apart, of `width` pixels of blue, green and red, a byte each. Throws std::runtime_error if the picture is
/// empty or libpng refuses it. Not real-time safe.
///
/// For pictures that a command saves. OpenCV's image reader and writer would load a hundred libraries at the
/// start of every process for this.
std::vector<std::uint8_t> encode_png(const std::uint8_t* bgr, int width, int height, std::size_t stride);

}  // namespace phantom::pictures

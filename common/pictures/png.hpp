#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace phantom::pictures {

/// The bytes of a PNG file of a picture. `bgr`: rows from the top, `stride` bytes apart, of `width` pixels of
/// blue, green and red, a byte each. Throws std::runtime_error if the picture is empty or libpng refuses it.
/// Not real-time safe.
///
/// For pictures that a command leaves behind; OpenCV's reader and writer of images would load a hundred
/// libraries for it at the start of every process.
std::vector<std::uint8_t> encode_png(const std::uint8_t* bgr, int width, int height, std::size_t stride);

}  // namespace phantom::pictures

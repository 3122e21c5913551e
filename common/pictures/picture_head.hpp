#pragma once

#include <cstdint>
#include <optional>
#include <span>

namespace phantom::pictures {

enum class PictureKind { kPng, kJpeg };

/// What the head of a picture's file says. Sizes are at most 2³⁰, whatever the file says.
struct PictureHead {
  PictureKind kind = PictureKind::kPng;
  int width_px = 0, height_px = 0;
};

/// Returns the head of a PNG or JPEG file, by its octets alone and without decoding anything, so that a
/// picture can be refused by its size before it takes memory; nothing for what is neither. The rest of the
/// file may be damaged. Allocates nothing.
std::optional<PictureHead> picture_head(std::span<const std::uint8_t> file) noexcept;

}  // namespace phantom::pictures

#include "common/pictures/picture_head.hpp"

#include <algorithm>
#include <array>

namespace phantom::pictures {
namespace {

constexpr std::uint32_t kMaxSide_px = 1U << 30;

std::uint32_t big_endian(std::span<const std::uint8_t> octets) noexcept {
  std::uint32_t value = 0;
  for (const std::uint8_t octet : octets) value = value << 8 | octet;
  return value;
}

int side_px(std::span<const std::uint8_t> octets) noexcept {
  return static_cast<int>(std::min(big_endian(octets), kMaxSide_px));
}

bool is_png(std::span<const std::uint8_t> file) noexcept {
  constexpr std::array<std::uint8_t, 8> kHead{0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n'};
  return file.size() >= 24 && std::equal(kHead.begin(), kHead.end(), file.begin());
}

/// Walks over the segments up to the one that begins a frame.
std::optional<PictureHead> jpeg_head(std::span<const std::uint8_t> file) noexcept {
  if (file.size() < 4 || file[0] != 0xFF || file[1] != 0xD8) return std::nullopt;
  for (std::size_t at = 2; at + 9 < file.size();) {
    if (file[at] != 0xFF) return std::nullopt;
    const std::uint8_t kind = file[at + 1];
    const bool frame = kind >= 0xC0 && kind <= 0xCF && kind != 0xC4 && kind != 0xC8 && kind != 0xCC;
    if (frame)
      return PictureHead{PictureKind::kJpeg, side_px(file.subspan(at + 7, 2)),
                         side_px(file.subspan(at + 5, 2))};
    at += kind == 0xFF ? 1 : 2 + std::max<std::size_t>(2, big_endian(file.subspan(at + 2, 2)));
  }
  return std::nullopt;
}

}  // namespace

std::optional<PictureHead> picture_head(std::span<const std::uint8_t> file) noexcept {
  if (is_png(file))
    return PictureHead{PictureKind::kPng, side_px(file.subspan(16, 4)), side_px(file.subspan(20, 4))};
  return jpeg_head(file);
}

}  // namespace phantom::pictures

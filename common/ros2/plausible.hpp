#pragma once

#include <cstdint>
#include <span>
#include <string_view>

namespace phantom::ros2 {

/// Greatest length of a message that is decoded, and of a cloud, an image or a picture.
inline constexpr std::size_t kMaxOctets = std::size_t{1} << 20, kMaxDataOctets = std::size_t{64} << 20;
/// Greatest number of fields of a PointCloud2 that is decoded.
inline constexpr std::uint32_t kMaxFields = 64;

/// Returns whether a message of that DDS type (CDR with its header) may be decoded: it is not longer than its
/// type can be, so that a list which is announced must have been sent, and a cloud announces no more than
/// kMaxFields. What a decoder allocates is then bounded by some times the message's length.
bool is_plausible(std::string_view dds_type_name, std::span<const std::uint8_t> cdr) noexcept;

}  // namespace phantom::ros2

#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/core/status.hpp"

namespace phantom::workspace {

/// Returns the bytes as a zstd frame with content size and checksum, at the fastest level. Throws
/// std::runtime_error if zstd fails. Thread-safe; not real-time safe.
std::vector<std::uint8_t> compress(std::span<const std::uint8_t> bytes);
/// Returns the size of a frame's content; none if it is unknown or this is no frame.
std::optional<std::uint64_t> content_size(std::span<const std::uint8_t> frame);
/// Decompresses a frame whose content fills `to`. Thread-safe; not real-time safe.
core::Status decompress(std::span<const std::uint8_t> frame, std::span<std::uint8_t> to);

}  // namespace phantom::workspace

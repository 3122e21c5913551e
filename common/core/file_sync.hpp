#pragma once

#include <filesystem>

namespace phantom::core {

/// Brings to the disk that `file` stands in its folder: after it was made or renamed, a power failure cannot
/// undo that any more (its content needs its own fsync()). Returns false if the disk refuses; errno says why.
/// Real-time safe: no, it waits for the disk.
bool sync_folder_of(const std::filesystem::path& file) noexcept;

}  // namespace phantom::core

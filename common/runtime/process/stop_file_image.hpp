#pragma once

#include <sys/types.h>

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>

#include "common/teleop/coupling/stop_latch.hpp"

// The bytes of a stop's file (StopFile), without a mapping. Real-time safe: no, all of it.

namespace phantom::runtime {

/// The content of the file.
struct StopImage {
  std::array<char, 8> magic{'P', 'H', 'S', 'T', 'O', 'P', '1', '\0'};
  std::uint64_t id = 0;
  std::uint32_t cause = 0;
  std::array<char, 12> zero{};
};
static_assert(sizeof(StopImage) == 32);

/// Returns the stop in the file (id 0: none). Returns nothing if size or content are not those of such a
/// file, or if it cannot be read.
std::optional<teleop::StopRecord> stop_in(int descriptor) noexcept;
/// Returns whether the file has the size of a StopImage.
bool has_image_size(int descriptor) noexcept;
/// Makes the stop the whole content of the file and brings it to the disk. Returns false if that fails; errno
/// says why.
bool write_stop_image(int descriptor, const teleop::StopRecord& record) noexcept;
/// Returns the mode of a file of stops in the folder: who may read and write there may do so with the file.
/// In a folder for all users it has the sticky bit, by which systemd-tmpfiles spares it.
mode_t mode_of_stops_in(const std::filesystem::path& folder) noexcept;
/// Creates the file with no stop in it. It appears with its whole content, so an empty file is never one that
/// is about to be written. Its mode is mode_of_stops_in(). Returns its descriptor, or −1 and errno; EEXIST:
/// there is such a file now.
int create_stop_image(const std::filesystem::path& file);
/// Returns whether the open file is the one at that path.
bool is_same_file(int descriptor, const std::filesystem::path& file) noexcept;

}  // namespace phantom::runtime

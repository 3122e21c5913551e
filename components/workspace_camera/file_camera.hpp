#pragma once

#include <cstdint>
#include <filesystem>
#include <future>
#include <optional>
#include <vector>

#include "common/core/status.hpp"
#include "common/fusion/depth_image.hpp"

namespace phantom::workspace_camera {

/// A camera whose clouds are files.
struct FileOptions {
  std::filesystem::path folder;  ///< its *.pcd and *.ply, by their names
  fusion::PinholeCamera camera;
  double rate_hz = 15.0;
  double unit_m = 1.0;  ///< of the files' numbers
  bool repeat = false;  ///< from the first again after the last
};

/// Plays a folder of clouds, in the camera's frame, as the depths that the camera sees. The next file is read
/// on a thread of its own meanwhile. One thread.
class FileCamera {
 public:
  /// Throws core::MissingError if the folder cannot be read, core::ConfigError if it has no cloud.
  explicit FileCamera(FileOptions options);

  /// Returns the next cloud's depths, mm by pixel; nothing: the last was played, or the file is still being
  /// read. A file that is wrong is an error, which names it; the next call goes on with the file after it.
  core::Expected<std::optional<std::vector<std::uint16_t>>> next();
  /// Returns whether all was played.
  bool at_end() const { return !reading_.valid(); }
  const fusion::PinholeCamera& camera() const { return options_.camera; }
  std::size_t files() const { return files_.size(); }

 private:
  using Image = core::Expected<std::vector<std::uint16_t>>;
  void read_next();

  FileOptions options_;
  std::vector<std::filesystem::path> files_;
  std::size_t next_ = 0;
  std::future<Image> reading_;  // ends, and is waited for, before the rest goes
};

}  // namespace phantom::workspace_camera

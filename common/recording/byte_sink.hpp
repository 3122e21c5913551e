#pragma once

#include <filesystem>
#include <memory>

#include "common/core/status.hpp"
#include "common/recording/mcap_records.hpp"

namespace phantom::recording {

/// Receives a file's bytes in order.
class ByteSink {
 public:
  virtual ~ByteSink() = default;
  /// Writes all bytes. After a failure none of `bytes` counts as written.
  virtual core::Status write(ByteView bytes) = 0;
  /// Writes all data to the storage medium, so that it survives a crash of the host.
  virtual core::Status sync() = 0;
};

/// Writes a new file. Written data survives a crash of this process, and after sync() one of the host. A
/// write that fails half-way (no space left) is undone: the file then ends with the last complete write. A
/// file that others have removed or cut meanwhile fails the next write or sync (kUnavailable).
class FileSink : public ByteSink {
 public:
  /// Creates the file. Fails if it exists (kFailedPrecondition) or cannot be created.
  static core::Expected<std::unique_ptr<FileSink>> create(const std::filesystem::path& path);
  ~FileSink() override;
  FileSink(const FileSink&) = delete;
  FileSink& operator=(const FileSink&) = delete;

  core::Status write(ByteView bytes) override;
  core::Status sync() override;
  const std::filesystem::path& path() const { return path_; }

 private:
  FileSink(std::filesystem::path path, int descriptor) : path_(std::move(path)), descriptor_(descriptor) {}
  core::Status check() const;
  std::filesystem::path path_;
  int descriptor_;
  std::uint64_t written_ = 0;
};

}  // namespace phantom::recording

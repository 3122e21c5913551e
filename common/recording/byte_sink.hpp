#pragma once

#include <filesystem>
#include <memory>

#include "common/core/status.hpp"
#include "common/recording/mcap_records.hpp"

namespace phantom::recording {

/// Takes a file's bytes in order.
class ByteSink {
 public:
  virtual ~ByteSink() = default;
  /// All of them, or a Status; after a failure none of `bytes` counts as written.
  virtual core::Status write(ByteView bytes) = 0;
  /// Brings what was written to the medium, so that it survives the host's end.
  virtual core::Status sync() = 0;
};

/// A new file. What was written to it survives this process's end, and after sync() the host's. A write that
/// fails half-way (no space left) is taken back: the file ends with the last whole one.
class FileSink : public ByteSink {
 public:
  /// Fails if the file exists (kFailedPrecondition) or cannot be made.
  static core::Expected<std::unique_ptr<FileSink>> create(const std::filesystem::path& path);
  ~FileSink() override;
  FileSink(const FileSink&) = delete;
  FileSink& operator=(const FileSink&) = delete;

  core::Status write(ByteView bytes) override;
  core::Status sync() override;
  const std::filesystem::path& path() const { return path_; }

 private:
  FileSink(std::filesystem::path path, int descriptor) : path_(std::move(path)), descriptor_(descriptor) {}
  std::filesystem::path path_;
  int descriptor_;
  std::uint64_t written_ = 0;
};

}  // namespace phantom::recording

#pragma once

#include <filesystem>
#include <memory>

#include "common/core/status.hpp"
#include "common/recording/mcap_records.hpp"

namespace phantom::recording {

/// Gives access to a file's bytes at any offset.
class ByteSource {
 public:
  virtual ~ByteSource() = default;
  virtual std::uint64_t size() const = 0;
  /// Replaces `out` by `length` bytes from `offset` on. Fails if not all of them exist.
  virtual core::Status read(std::uint64_t offset, std::uint64_t length, Bytes& out) const = 0;
};

/// A file with the size that it has when it is opened, so that a file that is still being written can be
/// read.
class FileSource : public ByteSource {
 public:
  static core::Expected<std::unique_ptr<FileSource>> open(const std::filesystem::path& path);
  ~FileSource() override;
  FileSource(const FileSource&) = delete;
  FileSource& operator=(const FileSource&) = delete;
  std::uint64_t size() const override { return size_; }
  core::Status read(std::uint64_t offset, std::uint64_t length, Bytes& out) const override;

 private:
  FileSource(std::filesystem::path path, int descriptor, std::uint64_t size)
      : path_(std::move(path)), descriptor_(descriptor), size_(size) {}
  std::filesystem::path path_;
  int descriptor_;
  std::uint64_t size_;
};

/// Bytes in memory, which must outlive this object.
class MemorySource : public ByteSource {
 public:
  explicit MemorySource(ByteView bytes) : bytes_(bytes) {}
  std::uint64_t size() const override { return bytes_.size(); }
  core::Status read(std::uint64_t offset, std::uint64_t length, Bytes& out) const override;

 private:
  ByteView bytes_;
};

}  // namespace phantom::recording

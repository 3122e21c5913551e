#pragma once

#include <filesystem>
#include <memory>

#include "common/core/status.hpp"
#include "common/recording/mcap_records.hpp"

namespace phantom::recording {

/// Bytes of a file, at any place in it.
class ByteSource {
 public:
  virtual ~ByteSource() = default;
  virtual std::uint64_t size() const = 0;
  /// Replaces `out` by `length` bytes from `offset` on; a Status if they are not all there.
  virtual core::Status read(std::uint64_t offset, std::uint64_t length, Bytes& out) const = 0;
};

/// A file as long as it is when it is opened: one that is still being written may be read.
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

/// Bytes in memory, which outlive this.
class MemorySource : public ByteSource {
 public:
  explicit MemorySource(ByteView bytes) : bytes_(bytes) {}
  std::uint64_t size() const override { return bytes_.size(); }
  core::Status read(std::uint64_t offset, std::uint64_t length, Bytes& out) const override;

 private:
  ByteView bytes_;
};

}  // namespace phantom::recording

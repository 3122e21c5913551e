#include "common/recording/byte_source.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace phantom::recording {
namespace {

core::Status beyond_the_end(std::uint64_t offset) {
  return core::Status::invalid_argument("ends before what should stand at byte " + std::to_string(offset));
}

bool within(std::uint64_t size, std::uint64_t offset, std::uint64_t length) {
  return offset <= size && length <= size - offset;
}

}  // namespace

core::Expected<std::unique_ptr<FileSource>> FileSource::open(const std::filesystem::path& path) {
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) return core::Status::not_found(path.string() + ": " + std::strerror(errno));
  struct stat about {};
  if (fstat(descriptor, &about) != 0 || !S_ISREG(about.st_mode)) {
    close(descriptor);
    return core::Status::not_found(path.string() + ": is not a file");
  }
  return std::unique_ptr<FileSource>(
      new FileSource(path, descriptor, static_cast<std::uint64_t>(about.st_size)));
}

FileSource::~FileSource() { close(descriptor_); }

core::Status FileSource::read(std::uint64_t offset, std::uint64_t length, Bytes& out) const {
  if (!within(size_, offset, length)) return beyond_the_end(offset);
  out.resize(static_cast<std::size_t>(length));
  std::size_t done = 0;
  while (done < out.size()) {
    const ssize_t count =
        pread(descriptor_, out.data() + done, out.size() - done, static_cast<off_t>(offset + done));
    if (count < 0 && errno == EINTR) continue;
    if (count < 0)
      return {core::ErrorCode::kUnavailable, path_.string() + ": cannot be read: " + std::strerror(errno)};
    if (count == 0) return beyond_the_end(offset + done);
    done += static_cast<std::size_t>(count);
  }
  return {};
}

core::Status MemorySource::read(std::uint64_t offset, std::uint64_t length, Bytes& out) const {
  if (!within(bytes_.size(), offset, length)) return beyond_the_end(offset);
  const ByteView part = bytes_.subspan(static_cast<std::size_t>(offset), static_cast<std::size_t>(length));
  out.assign(part.begin(), part.end());
  return {};
}

}  // namespace phantom::recording

#include "common/recording/byte_sink.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "common/core/file_sync.hpp"

namespace phantom::recording {
namespace {

core::Status failure(const std::filesystem::path& path, const char* what, int error) {
  const auto code = error == ENOSPC || error == EDQUOT || error == EFBIG ? core::ErrorCode::kResourceExhausted
                    : error == EEXIST ? core::ErrorCode::kFailedPrecondition
                                      : core::ErrorCode::kUnavailable;
  return {code, path.string() + ": " + what + ": " + std::strerror(error)};
}

}  // namespace

core::Expected<std::unique_ptr<FileSink>> FileSink::create(const std::filesystem::path& path) {
  const int descriptor = open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644);
  if (descriptor < 0) return failure(path, "cannot be made", errno);
  std::unique_ptr<FileSink> sink(new FileSink(path, descriptor));
  if (!core::sync_folder_of(path)) {
    const int error = errno;
    unlink(path.c_str());
    return failure(path, "cannot be brought to the disk", error);
  }
  return sink;
}

FileSink::~FileSink() { close(descriptor_); }

// Whoever removes or cuts the file leaves the descriptor as it is: writes would succeed for nothing.
core::Status FileSink::check() const {
  struct stat found {};
  if (fstat(descriptor_, &found) != 0) return failure(path_, "cannot be looked at", errno);
  if (found.st_nlink == 0)
    return {core::ErrorCode::kUnavailable, path_.string() + ": was removed while it was written"};
  if (static_cast<std::uint64_t>(found.st_size) != written_)
    return {core::ErrorCode::kUnavailable,
            path_.string() + ": was changed by others while it was written: it has " +
                std::to_string(found.st_size) + " bytes instead of " + std::to_string(written_)};
  return {};
}

core::Status FileSink::write(ByteView bytes) {
  if (core::Status status = check(); !status) return status;
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t count = ::write(descriptor_, bytes.data() + done, bytes.size() - done);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) {
      const core::Status status = failure(path_, "cannot be written", count == 0 ? EIO : errno);
      if (ftruncate(descriptor_, static_cast<off_t>(written_)) == 0)
        lseek(descriptor_, static_cast<off_t>(written_), SEEK_SET);
      return status;
    }
    done += static_cast<std::size_t>(count);
  }
  written_ += bytes.size();
  return {};
}

core::Status FileSink::sync() {
  if (core::Status status = check(); !status) return status;
  if (fdatasync(descriptor_) != 0) return failure(path_, "cannot be brought to the disk", errno);
  return {};
}

}  // namespace phantom::recording

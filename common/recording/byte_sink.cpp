#include "common/recording/byte_sink.hpp"

#include <fcntl.h>
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

core::Status FileSink::write(ByteView bytes) {
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
  if (fdatasync(descriptor_) != 0) return failure(path_, "cannot be brought to the disk", errno);
  return {};
}

}  // namespace phantom::recording

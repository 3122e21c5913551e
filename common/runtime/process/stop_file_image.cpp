#include "common/runtime/process/stop_file_image.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <string>

namespace phantom::runtime {

bool has_image_size(int descriptor) noexcept {
  struct stat about {};
  return fstat(descriptor, &about) == 0 && about.st_size == static_cast<off_t>(sizeof(StopImage));
}

std::optional<teleop::StopRecord> stop_in(int descriptor) noexcept {
  StopImage image;
  if (!has_image_size(descriptor) ||
      pread(descriptor, &image, sizeof image, 0) != static_cast<ssize_t>(sizeof image))
    return std::nullopt;
  const StopImage right;
  if (image.magic != right.magic || image.zero != right.zero || image.cause >= teleop::kStopCauses)
    return std::nullopt;
  if (image.id == 0) return teleop::StopRecord{};
  return teleop::StopRecord{image.id, static_cast<teleop::StopCause>(image.cause)};
}

bool write_stop_image(int descriptor, const teleop::StopRecord& record) noexcept {
  StopImage image;
  image.id = record.id;
  image.cause = static_cast<std::uint32_t>(record.cause);
  const auto size = static_cast<off_t>(sizeof image);
  // Reserves the space, because a store would fail where the disk is full.
  if (const int error = posix_fallocate(descriptor, 0, size); error != 0) {
    errno = error;
    return false;
  }
  return ftruncate(descriptor, size) == 0 && pwrite(descriptor, &image, sizeof image, 0) == size &&
         fdatasync(descriptor) == 0;
}

mode_t mode_of_stops_in(const std::filesystem::path& folder) noexcept {
  struct stat about {};
  if (stat(folder.c_str(), &about) != 0) return 0644;
  const mode_t shared = about.st_mode & (S_IRGRP | S_IWGRP | S_IROTH | S_IWOTH);
  return S_IRUSR | S_IWUSR | shared | ((about.st_mode & S_IWOTH) != 0 ? S_ISVTX : 0);
}

int create_stop_image(const std::filesystem::path& file) {
  const std::string made = file.string() + ".new-" + std::to_string(getpid());
  unlink(made.c_str());  // of a process that died here
  const int descriptor = ::open(made.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
  if (descriptor < 0) return -1;
  bool placed =
      fchmod(descriptor, mode_of_stops_in(file.parent_path())) == 0 && write_stop_image(descriptor, {});
  if (placed && renameat2(AT_FDCWD, made.c_str(), AT_FDCWD, file.c_str(), RENAME_NOREPLACE) != 0)
    placed = errno == EINVAL && link(made.c_str(), file.c_str()) == 0;  // as on NFS
  if (placed) {
    unlink(made.c_str());
    return descriptor;
  }
  const int error = errno;
  unlink(made.c_str());
  close(descriptor);
  errno = error;
  return -1;
}

bool is_same_file(int descriptor, const std::filesystem::path& file) noexcept {
  struct stat open {
  }, there{};
  return fstat(descriptor, &open) == 0 && stat(file.c_str(), &there) == 0 && open.st_dev == there.st_dev &&
         open.st_ino == there.st_ino;
}

}  // namespace phantom::runtime

#include "common/core/file_sync.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <new>

namespace phantom::core {

bool sync_folder_of(const std::filesystem::path& file) noexcept {
  try {
    const std::filesystem::path folder = file.has_parent_path() ? file.parent_path() : ".";
    const int descriptor = open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (descriptor < 0) return false;
    const bool synced = fsync(descriptor) == 0 || errno == EINVAL;  // the file system knows no such thing
    const int problem = errno;
    close(descriptor);
    errno = problem;
    return synced;
  } catch (const std::bad_alloc&) {
    errno = ENOMEM;
    return false;
  }
}

}  // namespace phantom::core

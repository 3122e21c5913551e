#include "common/runtime/process/stop_folders.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <sstream>
#include <string>

#include "common/core/errors.hpp"
#include "common/core/file_sync.hpp"
#include "common/core/printable.hpp"
#include "common/runtime/process/stop_file_image.hpp"

namespace phantom::runtime {
namespace {

using Folders = std::vector<std::filesystem::path>;

constexpr std::size_t kMaxBytes = 1'000'000;

[[noreturn]] void refuse_list(const std::filesystem::path& file, const std::string& what) {
  throw core::MissingError(file.string() + ": " + what +
                           "; it lists the other folders with stops of this host, so that none is missed");
}

[[noreturn]] void refuse_list_because(const std::filesystem::path& file, const char* what) {
  refuse_list(file, std::string(what) + " (" + std::strerror(errno) + ")");
}

// An open, locked list. It is altered in place: in a folder for all users nobody may replace another's file.
class OpenList {
 public:
  OpenList(const std::filesystem::path& file, int flags)
      : descriptor_(::open(file.c_str(), flags | O_CLOEXEC, 0600)) {
    if (descriptor_ >= 0) flock(descriptor_, (flags & O_ACCMODE) == O_RDONLY ? LOCK_SH : LOCK_EX);
  }
  ~OpenList() {
    if (descriptor_ >= 0) close(descriptor_);
  }
  OpenList(const OpenList&) = delete;
  OpenList& operator=(const OpenList&) = delete;

  bool is_open() const noexcept { return descriptor_ >= 0; }
  bool let_in_who_may_write(const std::filesystem::path& folder) const noexcept {
    return fchmod(descriptor_, mode_of_stops_in(folder)) == 0;
  }
  Folders read(const std::filesystem::path& file) const {
    std::string text;
    std::array<char, 4096> part;
    for (ssize_t size = 1; size > 0; text.append(part.data(), static_cast<std::size_t>(size))) {
      size = pread(descriptor_, part.data(), part.size(), static_cast<off_t>(text.size()));
      if (size < 0) refuse_list_because(file, "cannot be read");
      if (text.size() > kMaxBytes)
        refuse_list(file, "is too long: look for stops in force, then remove the file");
      if (size == 0) break;
    }
    Folders folders;
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) {
      const std::filesystem::path folder(line);
      if (!folder.is_absolute())
        refuse_list(file, "'" + core::printable(line.substr(0, 80)) +
                              "' is no absolute path: look for stops in force, then remove the file");
      std::error_code problem;
      if (std::filesystem::exists(folder, problem) || problem) folders.push_back(folder);
    }
    return folders;
  }
  bool write(const std::string& text) const noexcept {
    const auto size = static_cast<off_t>(text.size());
    return pwrite(descriptor_, text.data(), text.size(), 0) == size && ftruncate(descriptor_, size) == 0 &&
           fdatasync(descriptor_) == 0;
  }

 private:
  int descriptor_;
};

}  // namespace

Folders StopFolders::read() const {
  const OpenList list(file_, O_RDONLY);
  if (!list.is_open() && errno == ENOENT) return {};
  if (!list.is_open()) refuse_list_because(file_, "cannot be read");
  return list.read(file_);
}

void StopFolders::add(const std::filesystem::path& folder) const {
  if (folder.string().find('\n') != std::string::npos)
    refuse_list(file_, "a folder's name may have no line break");
  const Folders listed = read();  // who may only read the list may still find the folder in it
  if (std::find(listed.begin(), listed.end(), folder) != listed.end()) return;
  {
    const OpenList made(file_, O_RDWR | O_CREAT | O_EXCL);
    if (!made.is_open() && errno != EEXIST) refuse_list_because(file_, "cannot be made");
    if (made.is_open() && !(made.let_in_who_may_write(file_.parent_path()) && core::sync_folder_of(file_)))
      refuse_list_because(file_, "cannot be made");
  }
  const OpenList list(file_, O_RDWR);
  if (!list.is_open()) refuse_list_because(file_, "cannot be written");
  Folders folders = list.read(file_);
  if (std::find(folders.begin(), folders.end(), folder) != folders.end()) return;
  if (folders.size() >= kMaxFolders)
    refuse_list(file_,
                "has " + std::to_string(kMaxFolders) + " folders: remove those that are not used any more");
  folders.push_back(folder);
  std::string text;
  for (const auto& each : folders) text.append(each.string()).append("\n");
  if (!list.write(text)) refuse_list_because(file_, "cannot be written");
}

}  // namespace phantom::runtime

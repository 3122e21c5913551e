#pragma once

#include <cstddef>
#include <filesystem>
#include <utility>
#include <vector>

namespace phantom::runtime {

/// The list of folders, besides the host's one place, in which processes of one side of a cell were told to
/// keep their stops: a text file with one absolute path a line. So a process in either place finds a stop in
/// the other.
class StopFolders {
 public:
  static constexpr std::size_t kMaxFolders = 32;

  /// `file`: of the list; it need not exist.
  explicit StopFolders(std::filesystem::path file) : file_(std::move(file)) {}

  /// Returns the folders of the list that still exist; none if there is no list. Throws core::MissingError
  /// naming the file if it cannot be read or holds a line that is no absolute path. Real-time safe: no.
  std::vector<std::filesystem::path> read() const;
  /// Adds a folder to the list, on the disk, unless it is there; folders that are gone are left out. All who
  /// may write in its folder may write the list. Throws core::MissingError if it cannot be written, or
  /// has kMaxFolders already. Real-time safe: no.
  void add(const std::filesystem::path& folder) const;

 private:
  std::filesystem::path file_;
};

}  // namespace phantom::runtime

#pragma once

#include <filesystem>
#include <string>

#include "common/core/network.hpp"
#include "common/teleop/coupling/stop_latch.hpp"

namespace phantom::runtime {

/// Keeps the stop that one side of a cell has in force in a memory-mapped file. write() is a store to memory,
/// so it never waits for a disk, and its value outlives the process however the process ends. To survive a
/// loss of power, flush() writes it to the disk; the kernel does so by itself within seconds.
///
/// Format: 32 octets in the host's byte order: "PHSTOP1" and a zero octet; the stop's id (0: none), stored
/// last; its cause; zeros.
class StopFile final : public teleop::StopStore {
 public:
  /// Opens or creates `folder`/`component`.domain-N[.PARTITION].stop, and the folder. A file with other
  /// contents counts as an emergency stop, because it may have been one. If another process holds the file,
  /// the next free one of up to eight numbered files is used. A stop in any of the eight files is adopted
  /// with its id, whichever file the previous process used. Throws core::MissingError naming the file if no
  /// file can be used, because a stop must outlive the process.
  StopFile(const std::filesystem::path& folder, const std::string& component,
           const core::NetworkOptions& network);
  ~StopFile() override;
  StopFile(const StopFile&) = delete;
  StopFile& operator=(const StopFile&) = delete;

  teleop::StopRecord read() const noexcept override;
  void write(const teleop::StopRecord& record) noexcept override;
  /// Writes changes since the last call to the disk, which may take long. Call it from one thread only, not
  /// the servo's.
  void flush() noexcept;

  const std::filesystem::path& file() const noexcept { return file_; }
  /// Returns what a person should know: a stop that is in force since before the start, and how the file was
  /// opened. Empty if there is nothing.
  const std::string& notice() const noexcept { return notice_; }

  struct Content;  ///< private to stop_file.cpp

 private:
  bool open(const std::filesystem::path& file);
  void adopt_from(const std::filesystem::path& file);
  void add_notice(const std::string& sentence);

  std::filesystem::path file_;
  std::string notice_;
  int descriptor_ = -1;
  teleop::StopId flushed_ = 0;
  Content* content_ = nullptr;
};

}  // namespace phantom::runtime

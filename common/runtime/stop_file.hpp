#pragma once

#include <filesystem>
#include <string>

#include "common/core/network.hpp"
#include "common/teleop/stop_latch.hpp"

namespace phantom::runtime {

/// The stop that one side of a cell has in force, in a file that is mapped into memory: write() is a store,
/// so it never waits for a disk, and what it has written outlives the process however that ends. Against the
/// loss of the host's power flush() brings it to the disk; the kernel does so by itself within seconds.
///
/// 32 octets in the host's byte order: "PHSTOP1" and a zero octet; the stop's id (0: none), stored last; its
/// cause; zero.
class StopFile final : public teleop::StopStore {
 public:
  /// Opens or makes `folder`/`component`.domain-N[.PARTITION].stop, and the folder. A file that holds
  /// something else counts as an emergency stop: it may have been one. If another process holds the file,
  /// the next free of up to eight with a number is taken. A stop in any of the eight is in force here, too,
  /// under the same name: whichever file the process before this one had. Throws core::MissingError, naming
  /// the file, where none can be had: a stop that would not outlive the process is none.
  StopFile(const std::filesystem::path& folder, const std::string& component,
           const core::NetworkOptions& network);
  ~StopFile() override;
  StopFile(const StopFile&) = delete;
  StopFile& operator=(const StopFile&) = delete;

  teleop::StopRecord read() const noexcept override;
  void write(const teleop::StopRecord& record) noexcept override;
  /// Brings what was written since the last call to the disk; may take long. One thread, not the servo's.
  void flush() noexcept;

  const std::filesystem::path& file() const noexcept { return file_; }
  /// What a person should know: a stop that is in force since before, and how the file was opened; empty:
  /// nothing.
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

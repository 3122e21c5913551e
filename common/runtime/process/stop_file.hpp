#pragma once

#include <atomic>
#include <filesystem>
#include <mutex>
#include <string>
#include <thread>

#include "common/core/clock.hpp"
#include "common/core/network.hpp"
#include "common/runtime/process/guarded_page.hpp"
#include "common/runtime/process/stop_place.hpp"
#include "common/runtime/process/wake_signal.hpp"
#include "common/teleop/coupling/stop_latch.hpp"

namespace phantom::runtime {

/// Keeps the stop that one side of a cell has in force in a memory-mapped file. write() is a store to memory,
/// so it never waits for a disk, and its value outlives the process however the process ends.
///
/// A thread of its own compares the file with the stop in force after each write() and every kCheckPeriod_s:
/// whether the file is still at its place, has its size and its contents. It writes a file that is gone, was
/// replaced, cut short or altered again, logs that, and writes each stop to the disk to survive a loss of
/// power. So a stop is lost only if the process dies within kCheckPeriod_s of such an event.
///
/// Format: 32 bytes in the host's byte order: "PHSTOP1" and a zero byte; the stop's id (0: none), stored
/// last; its cause; zeros.
class StopFile final : public teleop::StopStore {
 public:
  static constexpr double kCheckPeriod_s = 0.05;
  static constexpr double kLogPeriod_s = 5.0;  ///< a file that cannot be written is logged at most so often

  /// Opens or creates `place.folder`/`component`.domain-N[.PARTITION].stop, and the folder. An existing file
  /// of another size or with other contents counts as an emergency stop, because it may have been one. If
  /// another process holds the file, the next free one of up to eight numbered files is used. A stop in any
  /// of the eight files is adopted with its id, whichever file the previous process used; so is one in a
  /// former place, in the host's one place, and in any folder that this one lists (StopFolders). Throws
  /// core::MissingError naming the file if no file can be used, if one of the eight cannot be read, or if a
  /// process of this side runs that keeps its stops in another folder.
  StopFile(StopPlace place, const std::string& component, const core::NetworkOptions& network);
  ~StopFile() override;
  StopFile(const StopFile&) = delete;
  StopFile& operator=(const StopFile&) = delete;

  teleop::StopRecord read() const noexcept override;
  /// Call it from one thread only.
  void write(const teleop::StopRecord& record) noexcept override;
  /// Compares the file now, writes it again if need be, and writes it to the disk, which may take long.
  /// Thread-safe. Real-time safe: no.
  void flush() noexcept;

  /// The file in use. It changes if its place is taken by a file that another process holds.
  std::filesystem::path file() const;
  /// Returns what a person should know: a stop that is in force since before the start, and how the file was
  /// opened. Empty if there is nothing.
  const std::string& notice() const noexcept { return notice_; }
  /// Returns why the stop cannot be kept at present; empty if it can. Thread-safe; waits for no disk.
  std::string trouble() const;

  struct Content;  ///< private to stop_file.cpp

 private:
  bool open(const std::filesystem::path& file, bool starting);
  void open_first_free(bool starting);
  void adopt_all();
  void adopt_from(const std::filesystem::path& file, bool may_be_held);
  void join_other_folders();
  void add_notice(const std::string& sentence);
  void set_trouble(const std::string& text);
  void take(int descriptor, const std::filesystem::path& file);
  void store(const teleop::StopRecord& record) noexcept;
  std::string fault() const;
  void check();
  void restore(bool in_place);

  const StopPlace place_;
  const std::string component_, name_;
  std::string notice_;
  mutable std::mutex text_mutex_;  // of file_ and trouble_, never held while the disk is waited for
  std::filesystem::path file_;     // changed under both mutexes
  std::string trouble_;
  std::mutex mutex_;  // of all below that the servo does not use
  int descriptor_ = -1;
  bool synced_ = false;  // whether the disk has the stop flushed_
  teleop::StopId flushed_ = 0;
  core::Nanoseconds logged_ns_ = 0;
  GuardedPage page_;
  Content* content_ = nullptr;
  std::atomic<std::uint64_t> id_{0};
  std::atomic<std::uint32_t> cause_{0};
  std::atomic<std::uint32_t> writes_{0};  // odd while write() runs
  WakeSignal written_;
  std::jthread keeper_;  // the last member: it ends first
};

}  // namespace phantom::runtime

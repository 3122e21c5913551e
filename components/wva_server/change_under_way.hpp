#pragma once

#include <atomic>
#include <optional>
#include <semaphore>
#include <string>
#include <thread>

#include "components/wva_server/wva_server.hpp"

namespace phantom::wva_server {

/// One command that is being carried out on a thread of its own, so that the thread that serves goes on. That
/// thread calls all methods, and leaves the cell alone until the change has ended.
class ChangeUnderWay {
 public:
  /// Begins. `options`: threads and stopwatch; progress and the end are the change's own. `must_end`: whether
  /// the process is asked to stop; called on any thread.
  ChangeUnderWay(LiveCell& cell, WorkspaceCommand command, std::uint64_t version,
                 layers::ActivationOptions options, bool (*must_end)());
  /// Ends the change if it has not ended.
  ~ChangeUnderWay() { end(); }
  ChangeUnderWay(const ChangeUnderWay&) = delete;
  ChangeUnderWay& operator=(const ChangeUnderWay&) = delete;

  const WorkspaceCommand& command() const { return command_; }
  /// Returns the change in words: "add 'pump'".
  const std::string& doing() const { return doing_; }
  /// Returns the share of the work that is done, 0…1.
  double share() const { return share_.load(std::memory_order_relaxed); }
  /// Returns whether a later command for the same object makes this one needless.
  bool is_overtaken_by(const WorkspaceCommand& later) const;
  /// Asks it to end soon, without a change.
  void end() { ended_.store(true, std::memory_order_relaxed); }
  /// Returns whether end() was called.
  bool was_ended() const { return ended_.load(std::memory_order_relaxed); }
  /// Waits for its end for at most `wait_s`; returns whether it has ended.
  bool wait(double wait_s);
  /// Returns what came of it; once, after wait() returned true.
  core::Expected<CellChange> take() { return std::move(*change_); }

 private:
  WorkspaceCommand command_;
  std::string object_, doing_;  // the name of the object that it is about, if there is one
  std::uint16_t id_ = 0;
  std::atomic<double> share_{0.0};
  std::atomic<bool> ended_{false};
  std::optional<core::Expected<CellChange>> change_;  // written before done_ is released
  std::binary_semaphore done_{0};
  bool is_done_ = false;
  std::jthread thread_;
};

}  // namespace phantom::wva_server

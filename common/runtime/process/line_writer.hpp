#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <thread>

namespace phantom::runtime {

/// Writes lines to a file descriptor without making the caller wait for the reader. A separate thread writes
/// the lines in order as the reader takes them. If nobody reads, the oldest waiting lines are dropped. Their
/// number is written in their place once the reader continues.
class LineWriter {
 public:
  static constexpr std::size_t kMaxWaiting = 1024;
  static constexpr double kGrace_s = 0.2;  ///< time given to the reader at the end

  /// Keeps a copy of `descriptor`. Throws std::system_error if no thread can be started.
  explicit LineWriter(int descriptor, std::size_t most_waiting = kMaxWaiting);
  /// Writes the waiting lines if the reader takes them within kGrace_s; else drops them.
  ~LineWriter();
  LineWriter(const LineWriter&) = delete;
  LineWriter& operator=(const LineWriter&) = delete;

  /// Queues `text`, which includes its line end. Never waits for the reader. Thread-safe. Uses the heap and,
  /// for a few instructions, a mutex with priority inheritance: for publishing and serving threads, not for a
  /// servo.
  void put(std::string text);
  /// Waits at most `limit_s` until all queued text has been written. Returns whether it has. Thread-safe.
  bool flush(double limit_s);

 private:
  struct State;
  static void work(const std::shared_ptr<State>& state);
  std::shared_ptr<State> state_;
  std::thread thread_;
};

}  // namespace phantom::runtime

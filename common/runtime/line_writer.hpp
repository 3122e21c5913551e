#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <thread>

namespace phantom::runtime {

/// Lines on their way to a file descriptor. Whoever puts one never waits for who reads: a thread of its own
/// writes them, in order, as the reader takes them. If nobody reads, the oldest that wait are left out, and
/// their number is written in their place once somebody does.
class LineWriter {
 public:
  static constexpr std::size_t kMostWaiting = 1024;
  static constexpr double kGrace_s = 0.2;  ///< given to a reader at the end

  /// Keeps a copy of `descriptor`. Throws std::system_error if no thread can be started.
  explicit LineWriter(int descriptor, std::size_t most_waiting = kMostWaiting);
  /// Writes what waits if somebody reads it within kGrace_s; else leaves it.
  ~LineWriter();
  LineWriter(const LineWriter&) = delete;
  LineWriter& operator=(const LineWriter&) = delete;

  /// Queues `text`, line end included. Never waits for the reader; thread-safe. It uses the heap and, for a
  /// few instructions, a lock that lends its holder the waiter's priority: for threads that publish or serve,
  /// not for a servo.
  void put(std::string text);
  /// Waits until all that was put has been written, at most `limit_s`; whether it was. Thread-safe.
  bool flush(double limit_s);

 private:
  struct State;
  static void work(const std::shared_ptr<State>& state);
  std::shared_ptr<State> state_;
  std::thread thread_;
};

}  // namespace phantom::runtime

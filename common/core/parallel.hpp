#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <exception>
#include <mutex>

namespace phantom::core {

namespace detail {
/// Calls turn(work, worker) on the caller's thread with worker 0 and, once each, on up to `helpers` threads
/// of the process's own pool with worker 1, 2, … Does not wait for helpers that have not begun when the
/// caller's turn is over.
void take_turns(std::size_t helpers, void (*turn)(const void* work, std::size_t worker), const void* work);
}  // namespace detail

/// Calls work(i, worker) once for each i < count, on up to `threads` threads. The caller's thread is worker
/// 0, and the next free thread takes the next i. Returns when all are done. The first exception stops the
/// remaining work and is thrown to the caller. The other threads belong to a pool of the process and stay for
/// the next call. Calls may be nested and may come from several threads at once. Not real-time safe.
template <class Work>
void parallel_for(int threads, std::size_t count, const Work& work) {
  std::atomic<std::size_t> next{0};
  std::mutex mutex;
  std::exception_ptr failure;
  const auto turn = [&](std::size_t worker) {
    try {
      for (std::size_t i = next++; i < count; i = next++) work(i, worker);
    } catch (...) {
      next = count;
      const std::lock_guard lock(mutex);
      if (!failure) failure = std::current_exception();
    }
  };
  const std::size_t workers = std::min(threads > 1 ? static_cast<std::size_t>(threads) : 1, count);
  detail::take_turns(
      workers > 1 ? workers - 1 : 0,
      [](const void* turns, std::size_t worker) { (*static_cast<decltype(&turn)>(turns))(worker); }, &turn);
  if (failure) std::rethrow_exception(failure);
}

}  // namespace phantom::core

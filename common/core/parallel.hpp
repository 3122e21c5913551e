#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <exception>
#include <mutex>

namespace phantom::core {

namespace detail {
/// Calls turn(work, worker) here with worker 0 and, once each, on up to `helpers` threads of the process's
/// own with worker 1, 2, …; helpers that have not begun when the caller's turn is over are not waited for.
void take_turns(std::size_t helpers, void (*turn)(const void* work, std::size_t worker), const void* work);
}  // namespace detail

/// Calls work(i, worker) once for each i < count, on up to `threads` threads of which the caller's is worker
/// 0; the next free thread takes the next i. Returns when all are done. The first exception ends the rest and
/// is thrown here. The other threads are the process's own and stay for the next call. Calls may be nested
/// and may come from several threads at once. Not real-time safe.
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

#pragma once

#include <atomic>
#include <cstddef>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace phantom::core {

/// Calls work(i, worker) once for each i < count, on up to `threads` threads of which the caller's is worker
/// 0; the next free thread takes the next i. Returns when all are done. The first exception ends the rest and
/// is thrown here. Not real-time safe.
template <class Work>
void parallel_for(int threads, std::size_t count, const Work& work) {
  std::atomic<std::size_t> next{0};
  std::mutex mutex;
  std::exception_ptr failure;
  const auto take_turns = [&](std::size_t worker) {
    try {
      for (std::size_t i = next++; i < count; i = next++) work(i, worker);
    } catch (...) {
      next = count;
      const std::lock_guard lock(mutex);
      if (!failure) failure = std::current_exception();
    }
  };
  {
    std::vector<std::jthread> others;
    const std::size_t most = threads > 1 ? static_cast<std::size_t>(threads) : 1;
    for (std::size_t worker = 1; worker < most && worker < count; ++worker)
      others.emplace_back(take_turns, worker);
    take_turns(0);
  }
  if (failure) std::rethrow_exception(failure);
}

}  // namespace phantom::core

#pragma once

#include <atomic>
#include <functional>
#include <string>

#include "common/core/parallel.hpp"
#include "common/core/status.hpp"
#include "common/core/work_budget.hpp"

namespace phantom::workspace {

/// How an operation that may take seconds runs, and how its caller can stop it.
struct WorkOptions {
  int threads = 1;
  /// Called now and then in the caller's thread with the share that is done. Returning false ends the
  /// operation without a result.
  std::function<bool(double share)> go_on;
  /// If not null, work is counted for it on all threads, and ends without a result when it is used up.
  core::WorkBudget* budget = nullptr;
};

/// Returns the error of an operation that ended without a result: over its budget, or stopped.
inline core::Status ended_early(const WorkOptions& options, const std::string& what) {
  if (options.budget == nullptr || !options.budget->exceeded())
    return {core::ErrorCode::kUnavailable, what + " was stopped"};
  return {
      core::ErrorCode::kResourceExhausted,
      what + " takes more than " + std::to_string(options.budget->most() / 1'000'000) +
          " million steps; allowed: at most that. Is the shape too intricate, or too large for the voxels?"};
}

/// Calls work(i, worker) for each i < count as core::parallel_for(). Returns false if options.go_on or the
/// budget ended it.
template <class Work>
bool parallel_for(const WorkOptions& options, std::size_t count, const Work& work) {
  std::atomic<bool> stopped = false;
  core::parallel_for(options.threads, count, [&](std::size_t i, std::size_t worker) {
    if (stopped) return;
    if (options.budget != nullptr && !options.budget->spend(1)) stopped = true;
    if (worker == 0 && options.go_on && !options.go_on(static_cast<double>(i) / static_cast<double>(count)))
      stopped = true;
    if (stopped) return;
    work(i, worker);
  });
  return !stopped && !(options.budget != nullptr && options.budget->ended());
}

}  // namespace phantom::workspace

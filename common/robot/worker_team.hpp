#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <thread>
#include <vector>

namespace phantom::robot {

/// Threads that share the parts of a short job, again and again, a thousand times a second: made once, parked
/// between jobs. Whoever is free takes the next part, so a worker that the host does not let run holds
/// nothing up but the part that it has begun.
class WorkerTeam {
 public:
  /// A job of more parts is not shared.
  static constexpr std::size_t kMostParts = (std::size_t{1} << 20U) - 1;

  /// `threads` work on a job, the caller's among them: starts one less. Throws std::system_error.
  explicit WorkerTeam(std::size_t threads);
  ~WorkerTeam();
  WorkerTeam(const WorkerTeam&) = delete;
  WorkerTeam& operator=(const WorkerTeam&) = delete;

  std::size_t threads() const noexcept { return workers_.size() + 1; }

  /// Calls work(part) once for each part < parts, in any order, on any thread of the team; returns when all
  /// are done. What the parts write is then the caller's to read. `work` must not throw. One caller at a
  /// time. Real-time safe: yes, if `work` is: no heap and no lock; a system call to wake workers that are
  /// parked.
  template <class Work>
  void run(std::size_t parts, const Work& work) noexcept {
    run(
        parts, [](const void* job, std::size_t part) { (*static_cast<const Work*>(job))(part); }, &work);
  }

 private:
  using Call = void (*)(const void* job, std::size_t part);
  void run(std::size_t parts, Call call, const void* job) noexcept;
  void serve() noexcept;
  /// Takes parts of the job at hand until none is left.
  void take_parts() noexcept;

  // A job's number (24 bits), its number of parts and the next part (20 bits each), in one word: who takes a
  // part by exchanging it knows that the job is still the one it read.
  alignas(64) std::atomic<std::uint64_t> ticket_{0};
  alignas(64) std::atomic<std::int32_t> done_{0};  // parts of this job
  alignas(64) std::atomic<std::int32_t> bell_{0};  // rung for each job
  std::atomic<bool> stop_{false};
  Call call_ = nullptr;  // written before the ticket; read by who has taken a part
  const void* job_ = nullptr;
  std::vector<std::jthread> workers_;
};

}  // namespace phantom::robot

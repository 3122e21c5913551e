#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <thread>
#include <vector>

namespace phantom::robot {

/// A team of threads that share the parts of a short job, a thousand times a second. The threads start once
/// and park between jobs. A free thread takes the next part, so a worker that the host does not schedule
/// delays only the part it has begun.
class WorkerTeam {
 public:
  /// A job of more parts runs on the caller's thread alone.
  static constexpr std::size_t kMaxParts = (std::size_t{1} << 20U) - 1;

  /// Creates a team of `threads` including the caller's, so it starts one thread fewer. Throws
  /// std::system_error.
  explicit WorkerTeam(std::size_t threads);
  ~WorkerTeam();
  WorkerTeam(const WorkerTeam&) = delete;
  WorkerTeam& operator=(const WorkerTeam&) = delete;

  std::size_t threads() const noexcept { return workers_.size() + 1; }

  /// Calls work(part) once for each part < parts, in any order, on any thread of the team. Returns when all
  /// are done; the caller may then read what the parts wrote. `work` must not throw. Only one caller at a
  /// time. Real-time safe: yes, if `work` is: no heap and no lock, but a system call to wake parked workers.
  template <class Work>
  void run(std::size_t parts, const Work& work) noexcept {
    run(
        parts, [](const void* job, std::size_t part) { (*static_cast<const Work*>(job))(part); }, &work);
  }

 private:
  using Call = void (*)(const void* job, std::size_t part);
  void run(std::size_t parts, Call call, const void* job) noexcept;
  void serve() noexcept;
  /// Takes parts of the current job until none is left.
  void take_parts() noexcept;

  // The job's number (24 bits), its number of parts and its next part (20 bits each), in one word. A thread
  // takes a part by compare-exchange, which fails if the job is no longer the one the thread read.
  alignas(64) std::atomic<std::uint64_t> ticket_{0};
  alignas(64) std::atomic<std::int32_t> done_{0};         // finished parts of this job
  alignas(64) std::atomic<std::int32_t> job_counter_{0};  // incremented for each job
  std::atomic<bool> stop_{false};
  Call call_ = nullptr;  // written before the ticket; read after taking a part
  const void* job_ = nullptr;
  std::vector<std::jthread> workers_;
};

}  // namespace phantom::robot

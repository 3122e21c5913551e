#include "common/core/parallel.hpp"

#include <condition_variable>
#include <deque>
#include <thread>

#include "common/core/thread_config.hpp"

namespace phantom::core::detail {
namespace {

struct Job {
  void (*turn)(const void* work, std::size_t worker);
  const void* work;
  std::size_t wanted;  ///< helpers that have yet to begin
  std::size_t begun = 0, at_work = 0;
  std::condition_variable done{};  ///< at_work is 0
};

/// The pool of threads that wait for jobs. A job lives on its caller's stack.
class Helpers {
 public:
  void run(Job& job) {
    const std::size_t wanted = job.wanted;
    {
      const std::lock_guard lock(mutex_);
      for (; threads_ < wanted; ++threads_) std::thread([this] { serve(); }).detach();
      jobs_.push_back(&job);
    }
    for (std::size_t i = 0; i < wanted; ++i) posted_.notify_one();
    job.turn(job.work, 0);
    std::unique_lock lock(mutex_);
    std::erase(jobs_, &job);
    job.done.wait(lock, [&] { return job.at_work == 0; });
  }

 private:
  void serve() {
    apply_thread_config(ThreadRole::kHelper);
    std::unique_lock lock(mutex_);
    for (;;) {
      posted_.wait(lock, [this] { return !jobs_.empty(); });
      Job& job = *jobs_.front();
      const std::size_t worker = ++job.begun;
      if (--job.wanted == 0) jobs_.pop_front();
      ++job.at_work;
      lock.unlock();
      job.turn(job.work, worker);
      lock.lock();
      if (--job.at_work == 0) job.done.notify_one();
    }
  }

  std::mutex mutex_;
  std::condition_variable posted_;
  std::deque<Job*> jobs_;
  std::size_t threads_ = 0;
};

/// Returns the pool. It is never destroyed: its threads wait until the process ends.
Helpers& helpers() {
  static auto& all = *new Helpers;
  return all;
}

}  // namespace

void take_turns(std::size_t helpers_wanted, void (*turn)(const void* work, std::size_t worker),
                const void* work) {
  if (helpers_wanted == 0) return turn(work, 0);
  Job job{turn, work, helpers_wanted};
  helpers().run(job);
}

}  // namespace phantom::core::detail

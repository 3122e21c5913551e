#include "common/runtime/process/line_writer.hpp"

#include <fcntl.h>
#include <poll.h>
#include <pthread.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <deque>
#include <mutex>

#include "common/core/clock.hpp"
#include "common/core/thread_config.hpp"
#include "common/runtime/process/wake_signal.hpp"

namespace phantom::runtime {
namespace {

constexpr int kPoll_ms = 50;
constexpr std::size_t kPiece = 4096;  // PIPE_BUF: a pipe takes up to this size atomically

/// Mutex with priority inheritance: its holder runs at least as urgently as the threads that wait for it.
class InheritingMutex {
 public:
  InheritingMutex() {
    pthread_mutexattr_t attributes;
    pthread_mutexattr_init(&attributes);
    pthread_mutexattr_setprotocol(&attributes, PTHREAD_PRIO_INHERIT);
    pthread_mutex_init(&mutex_, &attributes);
    pthread_mutexattr_destroy(&attributes);
  }
  ~InheritingMutex() { pthread_mutex_destroy(&mutex_); }
  InheritingMutex(const InheritingMutex&) = delete;
  InheritingMutex& operator=(const InheritingMutex&) = delete;
  void lock() { pthread_mutex_lock(&mutex_); }
  void unlock() { pthread_mutex_unlock(&mutex_); }

 private:
  pthread_mutex_t mutex_;
};

/// Opens the same pipe or terminal once more, so that the non-blocking mode applies here only and not to all
/// processes that share it. Returns −1 for a file, which does not block, and for a socket, where each call
/// can be non-blocking.
int reopened(int descriptor) {
  struct stat about {};
  if (fstat(descriptor, &about) != 0 || !(S_ISFIFO(about.st_mode) || isatty(descriptor) == 1)) return -1;
  return open(("/proc/self/fd/" + std::to_string(descriptor)).c_str(),
              O_WRONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC);
}

}  // namespace

struct LineWriter::State {
  // Copies the descriptor: its number may be reused later, when standard error is redirected to silence a
  // library.
  State(int to, std::size_t most)
      : nonblocking(reopened(to)),
        descriptor(nonblocking >= 0 ? nonblocking : fcntl(to, F_DUPFD_CLOEXEC, 3)),
        most_waiting(most) {}
  ~State() {
    if (descriptor >= 0) close(descriptor);
  }

  /// Writes as much of `text` as possible without waiting for the reader. Returns −1 if it cannot be written
  /// at all.
  ssize_t write_some(const char* text, std::size_t size) const {
    if (nonblocking >= 0) return write(descriptor, text, size);
    const ssize_t sent = send(descriptor, text, size, MSG_DONTWAIT | MSG_NOSIGNAL);
    return sent < 0 && errno == ENOTSOCK ? write(descriptor, text, size) : sent;
  }

  /// Writes the whole text. Returns false if it gave up: the reader is gone, or the writer ends and nobody
  /// reads.
  bool write_all(const std::string& text) const {
    std::size_t done = 0;
    while (done < text.size()) {
      pollfd wait{descriptor, POLLOUT, 0};
      const int ready = poll(&wait, 1, kPoll_ms);
      if (ready <= 0) {
        if (given_up.load()) return false;
        continue;
      }
      const ssize_t count = write_some(text.data() + done, std::min(kPiece, text.size() - done));
      if (count >= 0) {
        done += static_cast<std::size_t>(count);
      } else if (errno != EAGAIN && errno != EINTR) {
        return false;
      }
    }
    return true;
  }

  const int nonblocking, descriptor;
  const std::size_t most_waiting;
  InheritingMutex mutex;  // guards the next three
  std::deque<std::string> waiting;
  std::size_t lost = 0;
  bool writing = false;
  std::atomic<bool> stop{false}, given_up{false}, ended{false};
  WakeSignal wake, written;
};

LineWriter::LineWriter(int descriptor, std::size_t most_waiting)
    : state_(std::make_shared<State>(descriptor, most_waiting)) {
  // Blocks all signals in the new thread; the threads that existed before handle them.
  sigset_t all, before;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &before);
  thread_ = std::thread([state = state_] {
    work(state);
    state->ended = true;
    state->written.raise();
  });
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
}

LineWriter::~LineWriter() {
  flush(kGrace_s);
  state_->given_up = true;
  state_->stop = true;
  state_->wake.raise();
  for (int i = 0; i < 2 && !state_->ended.load(); ++i) state_->written.wait(kGrace_s / 2);
  // A thread that hangs in a system call nevertheless keeps its share of the state, so it can be detached.
  state_->ended.load() ? thread_.join() : thread_.detach();
}

void LineWriter::put(std::string text) {
  {
    const std::lock_guard lock(state_->mutex);
    if (state_->waiting.size() >= state_->most_waiting) {
      state_->waiting.pop_front();
      ++state_->lost;
    }
    state_->waiting.push_back(std::move(text));
  }
  state_->wake.raise();
}

bool LineWriter::flush(double limit_s) {
  const core::Nanoseconds until_ns = core::monotonic_ns() + core::from_seconds(limit_s);
  for (;;) {
    {
      const std::lock_guard lock(state_->mutex);
      if (state_->waiting.empty() && !state_->writing) return true;
    }
    if (core::monotonic_ns() >= until_ns) return false;
    state_->written.wait(0.01);
  }
}

void LineWriter::work(const std::shared_ptr<State>& state) {
  core::apply_thread_config(core::ThreadRole::kOutput);
  while (!state->stop.load()) {
    state->wake.wait(1.0);
    for (;;) {
      std::string text;
      {
        const std::lock_guard lock(state->mutex);
        state->writing = !state->waiting.empty();
        if (!state->writing) break;
        if (state->lost > 0) text = std::to_string(state->lost) + " lines lost: they were not read in time\n";
        state->lost = 0;
        text += state->waiting.front();
        state->waiting.pop_front();
      }
      if (!state->write_all(text) && state->given_up.load()) return;
    }
    state->written.raise();
  }
}

}  // namespace phantom::runtime

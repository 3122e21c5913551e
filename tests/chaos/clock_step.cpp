// Preloaded (LD_PRELOAD) into the processes of one host: its wall clock is off by as many nanoseconds as the
// eight octets of the file $PHANTOM_CLOCK_STEP say, from the moment they are written on. Other clocks are
// left alone: CLOCK_MONOTONIC does not jump on a host whose wall clock is set either. What waits until a time
// of the wall clock is given the true time, so that nothing but the reading of the clock is changed.
#include <dlfcn.h>
#include <fcntl.h>
#include <pthread.h>
#include <semaphore.h>
#include <sys/mman.h>
#include <sys/time.h>
#include <time.h>
#include <unistd.h>

#include <atomic>
#include <cstdint>
#include <cstdlib>

namespace {

constexpr std::int64_t kNsPerS = 1'000'000'000;

const std::atomic<std::int64_t>* shared_offset() {
  static const std::atomic<std::int64_t> none{0};
  const char* path = std::getenv("PHANTOM_CLOCK_STEP");
  const int file = path != nullptr ? open(path, O_RDONLY | O_CLOEXEC) : -1;
  if (file < 0) return &none;
  void* where = mmap(nullptr, sizeof(std::int64_t), PROT_READ, MAP_SHARED, file, 0);
  close(file);
  return where == MAP_FAILED ? &none : static_cast<const std::atomic<std::int64_t>*>(where);
}

std::int64_t offset_ns() {
  static const std::atomic<std::int64_t>* const offset = shared_offset();
  return offset->load(std::memory_order_relaxed);
}

timespec moved(const timespec& time, std::int64_t by_ns) {
  const std::int64_t ns = time.tv_sec * kNsPerS + time.tv_nsec + by_ns;
  return {ns / kNsPerS, ns % kNsPerS};
}

bool is_wall(clockid_t clock) { return clock == CLOCK_REALTIME || clock == CLOCK_REALTIME_COARSE; }

template <class Function>
Function* next(const char* name, const char* version = nullptr) {
  void* found = version != nullptr ? dlvsym(RTLD_NEXT, name, version) : dlsym(RTLD_NEXT, name);
  return reinterpret_cast<Function*>(found);
}

}  // namespace

extern "C" {

int clock_gettime(clockid_t clock, timespec* time) noexcept {
  static auto* const real = next<int(clockid_t, timespec*)>("clock_gettime");
  const int result = real(clock, time);
  if (result == 0 && is_wall(clock)) *time = moved(*time, offset_ns());
  return result;
}

int gettimeofday(timeval* time, void*) noexcept {
  timespec now{};
  if (clock_gettime(CLOCK_REALTIME, &now) != 0) return -1;
  *time = {now.tv_sec, now.tv_nsec / 1000};
  return 0;
}

time_t time(time_t* result) noexcept {
  timespec now{};
  clock_gettime(CLOCK_REALTIME, &now);
  if (result != nullptr) *result = now.tv_sec;
  return now.tv_sec;
}

int clock_nanosleep(clockid_t clock, int flags, const timespec* until, timespec* left) {
  static auto* const real =
      next<int(clockid_t, int, const timespec*, timespec*)>("clock_nanosleep", "GLIBC_2.17");
  if (!is_wall(clock) || (flags & TIMER_ABSTIME) == 0) return real(clock, flags, until, left);
  const timespec truly = moved(*until, -offset_ns());
  return real(clock, flags, &truly, left);
}

int pthread_cond_timedwait(pthread_cond_t* condition, pthread_mutex_t* mutex, const timespec* until) {
  static auto* const real =
      next<int(pthread_cond_t*, pthread_mutex_t*, const timespec*)>("pthread_cond_timedwait", "GLIBC_2.3.2");
  const timespec truly = moved(*until, -offset_ns());
  return real(condition, mutex, &truly);
}

int pthread_cond_clockwait(pthread_cond_t* condition, pthread_mutex_t* mutex, clockid_t clock,
                           const timespec* until) {
  static auto* const real =
      next<int(pthread_cond_t*, pthread_mutex_t*, clockid_t, const timespec*)>("pthread_cond_clockwait");
  const timespec truly = is_wall(clock) ? moved(*until, -offset_ns()) : *until;
  return real(condition, mutex, clock, &truly);
}

int pthread_mutex_timedlock(pthread_mutex_t* mutex, const timespec* until) noexcept {
  static auto* const real = next<int(pthread_mutex_t*, const timespec*)>("pthread_mutex_timedlock");
  const timespec truly = moved(*until, -offset_ns());
  return real(mutex, &truly);
}

int sem_timedwait(sem_t* semaphore, const timespec* until) {
  static auto* const real = next<int(sem_t*, const timespec*)>("sem_timedwait");
  const timespec truly = moved(*until, -offset_ns());
  return real(semaphore, &truly);
}

}  // extern "C"

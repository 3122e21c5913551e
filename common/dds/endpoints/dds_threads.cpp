#include "common/dds/endpoints/dds_threads.hpp"

#include <pthread.h>
#include <sys/resource.h>
#include <unistd.h>

#include "common/core/thread_config.hpp"
#include "fast_dds/threads.hpp"

namespace phantom::dds {

void with_dds_threads(bool in_haptic_path, const std::function<void()>& make) {
  core::run_in_place(core::ThreadRole::kDds, 0, [&] {
    // Fails without the permission; the servo reports that for all threads.
    if (in_haptic_path) setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), kHapticNiceness);
    make();
  });
}

void take_receivers_place(int servo_priority) noexcept {
  thread_local bool asked = false;
  if (asked) return;
  asked = true;
  char name[16] = {};
  pthread_getname_np(pthread_self(), name, sizeof name);
  // A writer in the same process calls its readers on its own thread, which keeps its place.
  if (fast_dds::is_own_thread(name, core::place_of(core::ThreadRole::kDds).name))
    core::apply_thread_config(core::ThreadRole::kReceiver, servo_priority);
}

}  // namespace phantom::dds

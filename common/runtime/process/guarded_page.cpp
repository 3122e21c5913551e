#include "common/runtime/process/guarded_page.hpp"

#include <sys/mman.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdint>
#include <mutex>
#include <new>

namespace phantom::runtime {
namespace {

struct Slot {
  std::atomic<std::uintptr_t> begin{0};  // 0: free
  std::atomic<bool> lost{false};
};
std::array<Slot, GuardedPage::kMax> g_slots;
std::once_flag g_installed;
struct sigaction g_before {};  // written before the handler is installed
const std::uintptr_t g_page = static_cast<std::uintptr_t>(sysconf(_SC_PAGESIZE));

constexpr int kAccess = PROT_READ | PROT_WRITE;

// Only system calls are made here. Returning repeats the access.
void on_bus_error(int number, siginfo_t* info, void*) {
  const int error = errno;
  const bool by_access = info->si_code > 0;  // else kill() or the like
  const auto at = reinterpret_cast<std::uintptr_t>(info->si_addr);
  for (Slot& slot : g_slots) {
    const std::uintptr_t begin = slot.begin.load(std::memory_order_acquire);
    if (!by_access || begin == 0 || at < begin || at >= begin + g_page) continue;
    if (mmap(reinterpret_cast<void*>(begin), g_page, kAccess, MAP_PRIVATE | MAP_ANONYMOUS | MAP_FIXED, -1,
             0) == MAP_FAILED)
      break;
    slot.lost.store(true, std::memory_order_release);
    errno = error;
    return;
  }
  sigaction(SIGBUS, &g_before, nullptr);
  if (!by_access) raise(number);
}

void install() {
  sigaction(SIGBUS, nullptr, &g_before);
  struct sigaction action {};
  action.sa_sigaction = on_bus_error;
  action.sa_flags = SA_SIGINFO;
  sigaction(SIGBUS, &action, nullptr);
}

}  // namespace

GuardedPage::GuardedPage() {
  std::call_once(g_installed, install);
  address_ = mmap(nullptr, g_page, kAccess, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (address_ == MAP_FAILED) throw std::bad_alloc();
  for (slot_ = 0; slot_ < kMax; ++slot_) {
    std::uintptr_t free = 0;
    g_slots[slot_].lost = false;
    if (g_slots[slot_].begin.compare_exchange_strong(free, reinterpret_cast<std::uintptr_t>(address_)))
      return;
  }
  munmap(address_, g_page);
  throw std::bad_alloc();
}

GuardedPage::~GuardedPage() {
  g_slots[slot_].begin = 0;
  munmap(address_, g_page);
}

bool GuardedPage::map(int descriptor) noexcept {
  g_slots[slot_].lost = false;
  void* mapped = mmap(address_, g_page, kAccess, MAP_SHARED | MAP_FIXED | MAP_POPULATE, descriptor, 0);
  if (mapped == MAP_FAILED) return false;
  mlock(address_, g_page);  // if permitted: a servo must not wait for a page
  return true;
}

bool GuardedPage::lost() const noexcept { return g_slots[slot_].lost.load(std::memory_order_acquire); }

}  // namespace phantom::runtime

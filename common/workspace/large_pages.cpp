#include "common/workspace/large_pages.hpp"

#include <malloc.h>
#include <sys/mman.h>

#include <cstdint>

namespace phantom::workspace {

void prefer_large_pages(void* memory, std::size_t bytes) noexcept {
  constexpr std::uintptr_t kPage = std::uintptr_t{1} << 21;
  const auto from = reinterpret_cast<std::uintptr_t>(memory);
  const std::uintptr_t first = (from + kPage - 1) / kPage * kPage, last = (from + bytes) / kPage * kPage;
  if (first < last) ::madvise(reinterpret_cast<void*>(first), last - first, MADV_HUGEPAGE);
}

void keep_freed_memory(int bytes) noexcept {
#ifdef __GLIBC__
  ::mallopt(M_MMAP_MAX, 0);  // large blocks are allocated on the heap too, and freed to it
  ::mallopt(M_TRIM_THRESHOLD, bytes);
#else
  static_cast<void>(bytes);
#endif
}

}  // namespace phantom::workspace

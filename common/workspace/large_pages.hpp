#pragma once

#include <cstddef>
#include <memory>
#include <utility>
#include <vector>

namespace phantom::workspace {

/// Asks the operating system for large pages for memory that has not been written to yet. The first touch of
/// small pages took a sixth of an activation's time. This is only advice: it has no effect where it is not
/// supported or the memory is small.
void prefer_large_pages(void* memory, std::size_t bytes) noexcept;

/// Lets the process keep up to `bytes` of freed memory for its next activation. Otherwise the memory goes
/// back to the operating system and must be cleared page by page when it is allocated again, which took a
/// seventh of an activation's time. Call it early in main(). Has an effect with glibc's heap only.
void keep_freed_memory(int bytes) noexcept;

/// Allocates arrays of several megabytes: uses large pages, and does not write to elements that are
/// constructed without a value.
template <class T>
struct LargeAllocator : std::allocator<T> {
  template <class U>
  struct rebind {
    using other = LargeAllocator<U>;
  };
  T* allocate(std::size_t count) {
    T* memory = std::allocator<T>::allocate(count);
    prefer_large_pages(memory, count * sizeof(T));
    return memory;
  }
  template <class U>
  void construct(U* place) noexcept {
    ::new (static_cast<void*>(place)) U;
  }
  template <class U, class... Values>
  void construct(U* place, Values&&... values) {
    ::new (static_cast<void*>(place)) U(std::forward<Values>(values)...);
  }
};
template <class T>
using LargeVector = std::vector<T, LargeAllocator<T>>;

}  // namespace phantom::workspace

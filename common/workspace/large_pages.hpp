#pragma once

#include <cstddef>
#include <memory>
#include <utility>
#include <vector>

namespace phantom::workspace {

/// Asks the system for large pages under memory that nobody has written to yet: the first touch of small ones
/// took a sixth of an activation's time. Only advice; nothing happens where it is not understood or the
/// memory is small.
void prefer_large_pages(void* memory, std::size_t bytes) noexcept;

/// Lets the process keep up to `bytes` of memory that it has freed, for its next activation, rather than give
/// it back to the system and get it anew, cleared page by page: a seventh of an activation's time. For
/// main(), early. Only glibc's heap knows how.
void keep_freed_memory(int bytes) noexcept;

/// For arrays of megabytes: large pages, and elements without a value of their own are not written to.
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

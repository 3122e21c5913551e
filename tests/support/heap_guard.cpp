#include "tests/support/heap_guard.hpp"

#include <unistd.h>

#include <cstdlib>
#include <new>
#include <string_view>

namespace {

thread_local int t_guards = 0;

void refuse_if_guarded() {
  if (t_guards == 0) return;
  constexpr std::string_view kMessage = "heap used inside a HeapGuard: this code must not allocate or free\n";
  [[maybe_unused]] const auto written = write(STDERR_FILENO, kMessage.data(), kMessage.size());
  std::abort();
}

void* checked_allocation_or_null(std::size_t size) noexcept {
  refuse_if_guarded();
  return std::malloc(size == 0 ? 1 : size);
}

void* checked_allocation(std::size_t size) {
  if (void* memory = checked_allocation_or_null(size)) return memory;
  throw std::bad_alloc();
}

void* checked_aligned_allocation(std::size_t size, std::size_t alignment) {
  refuse_if_guarded();
  if (void* memory = std::aligned_alloc(alignment, (size + alignment - 1) / alignment * alignment))
    return memory;
  throw std::bad_alloc();
}

void checked_free(void* memory) noexcept {
  if (memory != nullptr) refuse_if_guarded();
  std::free(memory);
}

}  // namespace

void* operator new(std::size_t size) { return checked_allocation(size); }
void* operator new[](std::size_t size) { return checked_allocation(size); }
void* operator new(std::size_t size, std::align_val_t alignment) {
  return checked_aligned_allocation(size, static_cast<std::size_t>(alignment));
}
void* operator new[](std::size_t size, std::align_val_t alignment) {
  return checked_aligned_allocation(size, static_cast<std::size_t>(alignment));
}
// Without these a sanitizer's own nothrow forms would serve, and their memory come back to the wrong delete.
void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  return checked_allocation_or_null(size);
}
void* operator new[](std::size_t size, const std::nothrow_t&) noexcept {
  return checked_allocation_or_null(size);
}
void operator delete(void* memory, const std::nothrow_t&) noexcept { checked_free(memory); }
void operator delete[](void* memory, const std::nothrow_t&) noexcept { checked_free(memory); }
void operator delete(void* memory) noexcept { checked_free(memory); }
void operator delete[](void* memory) noexcept { checked_free(memory); }
void operator delete(void* memory, std::size_t) noexcept { checked_free(memory); }
void operator delete[](void* memory, std::size_t) noexcept { checked_free(memory); }
void operator delete(void* memory, std::align_val_t) noexcept { checked_free(memory); }
void operator delete[](void* memory, std::align_val_t) noexcept { checked_free(memory); }
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { checked_free(memory); }
void operator delete[](void* memory, std::size_t, std::align_val_t) noexcept { checked_free(memory); }

namespace phantom::test {

HeapGuard::HeapGuard() { ++t_guards; }
HeapGuard::~HeapGuard() { --t_guards; }

}  // namespace phantom::test

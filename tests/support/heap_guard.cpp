#include "tests/support/heap_guard.hpp"

#include <dlfcn.h>
#include <unistd.h>

#include <cstdlib>
#include <new>
#include <string_view>

namespace {

thread_local int t_guards = 0;
thread_local const char* t_exempt_library = nullptr;

bool is_exempt(const void* caller) {
  Dl_info place{};
  return t_exempt_library != nullptr && dladdr(caller, &place) != 0 && place.dli_fname != nullptr &&
         std::string_view(place.dli_fname).find(t_exempt_library) != std::string_view::npos;
}

// `caller`: an address in the code that allocates or frees.
void refuse_if_guarded(const void* caller) {
  if (t_guards == 0 || is_exempt(caller)) return;
  constexpr std::string_view kMessage = "heap used inside a HeapGuard: this code must not allocate or free\n";
  [[maybe_unused]] const auto written = write(STDERR_FILENO, kMessage.data(), kMessage.size());
  std::abort();
}

void* checked_allocation_or_null(std::size_t size, const void* caller) noexcept {
  refuse_if_guarded(caller);
  return std::malloc(size == 0 ? 1 : size);
}

void* checked_allocation(std::size_t size, const void* caller) {
  if (void* memory = checked_allocation_or_null(size, caller)) return memory;
  throw std::bad_alloc();
}

void* checked_aligned_allocation(std::size_t size, std::size_t alignment, const void* caller) {
  refuse_if_guarded(caller);
  if (void* memory = std::aligned_alloc(alignment, (size + alignment - 1) / alignment * alignment))
    return memory;
  throw std::bad_alloc();
}

void checked_free(void* memory, const void* caller) noexcept {
  if (memory != nullptr) refuse_if_guarded(caller);
  std::free(memory);
}

}  // namespace

void* operator new(std::size_t size) { return checked_allocation(size, __builtin_return_address(0)); }
void* operator new[](std::size_t size) { return checked_allocation(size, __builtin_return_address(0)); }
void* operator new(std::size_t size, std::align_val_t alignment) {
  return checked_aligned_allocation(size, static_cast<std::size_t>(alignment), __builtin_return_address(0));
}
void* operator new[](std::size_t size, std::align_val_t alignment) {
  return checked_aligned_allocation(size, static_cast<std::size_t>(alignment), __builtin_return_address(0));
}
// Without these a sanitizer's own nothrow forms would serve, and their memory come back to the wrong delete.
void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  return checked_allocation_or_null(size, __builtin_return_address(0));
}
void* operator new[](std::size_t size, const std::nothrow_t&) noexcept {
  return checked_allocation_or_null(size, __builtin_return_address(0));
}
void operator delete(void* memory, const std::nothrow_t&) noexcept {
  checked_free(memory, __builtin_return_address(0));
}
void operator delete[](void* memory, const std::nothrow_t&) noexcept {
  checked_free(memory, __builtin_return_address(0));
}
void operator delete(void* memory) noexcept { checked_free(memory, __builtin_return_address(0)); }
void operator delete[](void* memory) noexcept { checked_free(memory, __builtin_return_address(0)); }
void operator delete(void* memory, std::size_t) noexcept {
  checked_free(memory, __builtin_return_address(0));
}
void operator delete[](void* memory, std::size_t) noexcept {
  checked_free(memory, __builtin_return_address(0));
}
void operator delete(void* memory, std::align_val_t) noexcept {
  checked_free(memory, __builtin_return_address(0));
}
void operator delete[](void* memory, std::align_val_t) noexcept {
  checked_free(memory, __builtin_return_address(0));
}
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept {
  checked_free(memory, __builtin_return_address(0));
}
void operator delete[](void* memory, std::size_t, std::align_val_t) noexcept {
  checked_free(memory, __builtin_return_address(0));
}

namespace phantom::test {

HeapGuard::HeapGuard(const char* exempt_library) : outer_(t_exempt_library) {
  ++t_guards;
  t_exempt_library = exempt_library;
}
HeapGuard::~HeapGuard() {
  --t_guards;
  t_exempt_library = outer_;
}

}  // namespace phantom::test

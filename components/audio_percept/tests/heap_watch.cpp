#include "components/audio_percept/tests/heap_watch.hpp"

#include <atomic>
#include <cstdlib>
#include <new>

namespace {
std::atomic<std::uint64_t> g_heap_uses{0};
}

[[gnu::noinline]] void* operator new(std::size_t size) {
  ++g_heap_uses;
  if (void* memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

namespace phantom::audio_percept {
std::uint64_t heap_uses() noexcept { return g_heap_uses; }
}  // namespace phantom::audio_percept

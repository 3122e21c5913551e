#include "tests/bench/counting_heap.hpp"

#include <malloc.h>

#include <atomic>
#include <cstdlib>
#include <new>

namespace {

std::atomic<std::size_t> used{0}, peak{0};

void* counted(void* block) {
  if (block == nullptr) throw std::bad_alloc();
  const std::size_t now = used.fetch_add(malloc_usable_size(block)) + malloc_usable_size(block);
  std::size_t before = peak.load();
  while (before < now && !peak.compare_exchange_weak(before, now)) {
  }
  return block;
}

void give_back(void* block) {
  if (block == nullptr) return;
  used.fetch_sub(malloc_usable_size(block));
  std::free(block);
}

void* aligned(std::size_t bytes, std::align_val_t alignment) {
  const auto edge = static_cast<std::size_t>(alignment);
  return counted(std::aligned_alloc(edge, (bytes + edge - 1) / edge * edge));
}

}  // namespace

void* operator new(std::size_t bytes) { return counted(std::malloc(bytes)); }
void* operator new[](std::size_t bytes) { return counted(std::malloc(bytes)); }
void* operator new(std::size_t bytes, std::align_val_t alignment) { return aligned(bytes, alignment); }
void* operator new[](std::size_t bytes, std::align_val_t alignment) { return aligned(bytes, alignment); }
void operator delete(void* block) noexcept { give_back(block); }
void operator delete[](void* block) noexcept { give_back(block); }
void operator delete(void* block, std::size_t) noexcept { give_back(block); }
void operator delete[](void* block, std::size_t) noexcept { give_back(block); }
void operator delete(void* block, std::align_val_t) noexcept { give_back(block); }
void operator delete[](void* block, std::align_val_t) noexcept { give_back(block); }
void operator delete(void* block, std::size_t, std::align_val_t) noexcept { give_back(block); }
void operator delete[](void* block, std::size_t, std::align_val_t) noexcept { give_back(block); }

namespace phantom::bench {

std::size_t heap_bytes() { return used.load(); }
std::size_t peak_heap_bytes() { return peak.load(); }
void reset_peak() { peak.store(used.load()); }

}  // namespace phantom::bench

#pragma once

namespace phantom::test {

/// While one lives, any use of the heap by its thread aborts the process: proof that a real-time function
/// allocates nothing. Link phantom::heap_guard, which replaces operator new and delete of the test
/// executable.
class HeapGuard {
 public:
  HeapGuard();
  ~HeapGuard();
  HeapGuard(const HeapGuard&) = delete;
  HeapGuard& operator=(const HeapGuard&) = delete;
};

}  // namespace phantom::test

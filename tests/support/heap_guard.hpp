#pragma once

namespace phantom::test {

/// While one lives, any use of the heap by its thread aborts the process: proof that a real-time function
/// allocates nothing. Link phantom::heap_guard, which replaces operator new and delete of the test
/// executable. `exempt_library`: what a shared library whose file name contains this allocates itself is
/// allowed, for code that is ours up to the calls of that library.
class HeapGuard {
 public:
  explicit HeapGuard(const char* exempt_library = nullptr);
  ~HeapGuard();
  HeapGuard(const HeapGuard&) = delete;
  HeapGuard& operator=(const HeapGuard&) = delete;

 private:
  const char* outer_;
};

}  // namespace phantom::test

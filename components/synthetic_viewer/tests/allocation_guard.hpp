#pragma once

#include <cstddef>

/// Heap allocations of this thread since the program started; counted by the operator new of
/// allocation_guard.cpp.
std::size_t allocation_count();

#pragma once

#include <cstddef>

namespace phantom::bench {

/// Bytes that operator new has given and not got back, and the most there ever were since reset_peak().
std::size_t heap_bytes();
std::size_t peak_heap_bytes();
void reset_peak();

}  // namespace phantom::bench

#pragma once

#include <cstdlib>

namespace phantom::bench {

/// Returns `wanted`, the repetitions of a benchmark that sets its own; 1 where `scripts/bench --once` runs
/// every benchmark once (it sets PHANTOM_BENCH_ONCE).
inline int repetitions(int wanted) {
  return std::getenv("PHANTOM_BENCH_ONCE") != nullptr ? 1 : wanted;  // NOLINT(concurrency-mt-unsafe)
}

}  // namespace phantom::bench

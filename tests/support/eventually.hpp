#pragma once

#include <chrono>
#include <thread>

namespace phantom::test {

/// Calls `probe` until it is true; false if it is not within the limit, which only bounds a failing test.
template <class Probe>
bool eventually(Probe&& probe, double limit_s = 60.0) {
  const auto until = std::chrono::steady_clock::now() + std::chrono::duration<double>(limit_s);
  while (!probe()) {
    if (std::chrono::steady_clock::now() > until) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return true;
}
template <class Probe>
bool eventually(Probe&& probe, std::chrono::seconds limit) {
  return eventually(probe, static_cast<double>(limit.count()));
}

}  // namespace phantom::test

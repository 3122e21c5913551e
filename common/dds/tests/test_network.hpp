#pragma once

#include <unistd.h>

#include <chrono>
#include <condition_variable>
#include <mutex>

#include "common/core/network.hpp"
#include "tests/support/eventually.hpp"
#include "tests/support/own_domain.hpp"

namespace phantom::dds {

/// Loopback only, in a domain that no other test process uses at the same time.
inline core::NetworkOptions test_network() {
  core::NetworkOptions network;
  network.domain = test::own_domain();
  network.qos_profiles = PHANTOM_SOURCE_DIR "/deploy/qos/phantom.xml";
  network.interfaces = {"127.0.0.1"};
  return network;
}

/// Waits for a condition that another thread brings about; the limit only bounds a failing test.
class Waiter {
 public:
  template <class Change>
  void change(Change&& apply) {
    {
      const std::lock_guard lock(mutex_);
      apply();
    }
    changed_.notify_all();
  }
  template <class Predicate>
  bool wait(Predicate&& predicate, std::chrono::seconds limit = std::chrono::seconds(30)) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, limit, predicate);
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
};

using phantom::test::eventually;

}  // namespace phantom::dds

#pragma once

#include "common/teleop/coupling/stop_latch.hpp"

namespace phantom::teleop {

/// Keeps a stop as a file does, for servos on a simulated clock: it outlives them.
struct MemoryStopStore final : StopStore {
  StopRecord record;
  int writes = 0;

  StopRecord read() const noexcept override { return record; }
  void write(const StopRecord& now) noexcept override {
    record = now;
    ++writes;
  }
};

}  // namespace phantom::teleop

#pragma once

#include <cstdint>

#include "common/core/stop_requests.hpp"

namespace phantom::teleop {

/// Names one stop of one side: random, so that no two stops of a cell ever share one. 0: none.
using StopId = std::uint64_t;

using core::kStopCauses;
using core::name_of;
using core::StopCause;

/// The stop that one side has in force.
struct StopRecord {
  StopId id = 0;
  StopCause cause = StopCause::kNone;
  friend bool operator==(const StopRecord&, const StopRecord&) = default;
};

/// Keeps the stop in force beyond the life of the process.
class StopStore {
 public:
  virtual ~StopStore() = default;
  /// What was kept last.
  virtual StopRecord read() const noexcept = 0;
  /// Once it returns, the record outlives the process, however that ends. Real-time safe: yes.
  virtual void write(const StopRecord& record) noexcept = 0;
};

using core::StopReset;

enum class ResetOutcome : std::uint8_t {
  kNone,      ///< no reset in this step
  kReleased,  ///< the stop in force is the one that was named (or there is none)
  kRefused,   ///< another stop is in force
};

/// What the latch is told in one tick.
struct StopSigns {
  std::uint32_t requests = 0;        ///< emergency stops that were asked for so far
  bool drive_fault = false;          ///< of this side's drives
  bool partner_stopped = false;      ///< the other side's newest word is that it is stopped
  StopId partner_stop = 0;           ///< and this names its stop
  const StopReset* reset = nullptr;  ///< one that came since the last tick
};

/// Holds one side's stop until a reset names it.
///
/// Every new request for an emergency stop and every new fault of the drives is a stop of its own, with an id
/// of its own. A stop of the other side stops this one too, unless a reset has named that stop. A reset while
/// drives are in fault releases once the fault is gone. Pure; deterministic for a seed.
class StopLatch {
 public:
  /// `seed`: random, another one in each process. `kept`: the stop that was in force when the process before
  /// this one ended.
  StopLatch(std::uint64_t seed, const StopRecord& kept) : random_(seed), record_(kept) {}

  /// Real-time safe: yes.
  ResetOutcome step(const StopSigns& signs) noexcept;
  const StopRecord& record() const noexcept { return record_; }
  bool stopped() const noexcept { return record_.id != 0; }

 private:
  void latch(StopCause cause) noexcept;
  ResetOutcome answer(const StopReset& reset) noexcept;

  std::uint64_t random_;
  StopRecord record_;
  StopId released_partner_ = 0;  // the other side's stop that a reset has named
  std::uint32_t requests_seen_ = 0;
  bool fault_before_ = false, releasing_ = false;
};

}  // namespace phantom::teleop

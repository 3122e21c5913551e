#pragma once

#include <cstdint>

#include "common/teleop/commands/stop_requests.hpp"

namespace phantom::teleop {

/// Identifies one stop of one side. It is random, so that no two stops of a cell share an id. 0: no stop.
using StopId = std::uint64_t;

/// The stop that one side has in force.
struct StopRecord {
  StopId id = 0;
  StopCause cause = StopCause::kNone;
  friend bool operator==(const StopRecord&, const StopRecord&) = default;
};

/// Interface of a store that keeps the stop in force beyond the life of the process.
class StopStore {
 public:
  virtual ~StopStore() = default;
  /// Returns the record that was written last.
  virtual StopRecord read() const noexcept = 0;
  /// Writes the record. Once this returns, the record outlives the process, however the process ends.
  /// Real-time safe: yes.
  virtual void write(const StopRecord& record) noexcept = 0;
};

using teleop::StopReset;

enum class ResetOutcome : std::uint8_t {
  kNone,      ///< no reset in this step
  kReleased,  ///< the reset names the stop in force, or there is none
  kRefused,   ///< the reset does not name the stop in force
};

/// Inputs of StopLatch for one tick.
struct StopSigns {
  std::uint32_t requests = 0;        ///< emergency stops requested so far
  bool drive_fault = false;          ///< this side's drives are in fault
  bool partner_stopped = false;      ///< the partner's newest sample says that it is stopped
  StopId partner_stop = 0;           ///< id of the partner's stop
  const StopReset* reset = nullptr;  ///< the reset that arrived since the last tick; null: none
};

/// Holds one side's stop until a reset names it.
///
/// Every new request for an emergency stop and every new fault of the drives is a new stop with a new id. A
/// stop of the partner stops this side too, unless a reset has named the partner's stop. A reset during a
/// fault of the drives releases the stop once the fault is gone. The class has no side effects and is
/// deterministic for a given seed.
class StopLatch {
 public:
  /// `seed`: random and different in each process. `kept`: the stop that was in force when the previous
  /// process ended.
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
  StopId released_partner_ = 0;  // the partner's stop that a reset has named
  std::uint32_t requests_seen_ = 0;
  bool fault_before_ = false, releasing_ = false;
};

}  // namespace phantom::teleop

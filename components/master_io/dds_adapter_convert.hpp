#pragma once

#include "common/core/status.hpp"
#include "components/master_io/dds_adapter.hpp"
#include "phantom_idl/percept.h"
#include "phantom_idl/teleoperation.h"

namespace phantom::master_io {

/// Why a sample cannot be used, in words for the log; null if it can. Order and source are checked
/// apart (dds::SourceGuard).
const char* refusal(const msg::SlaveState& slave, const Expectations& expected) noexcept;
const char* refusal(const msg::DragField& field, const Expectations& expected) noexcept;

/// `own_session`: whose master_states an echo must name to count as an answer.
SlaveSample to_sample(const msg::SlaveState& slave, core::Nanoseconds received_ns,
                      std::uint64_t own_session) noexcept;
DragSample to_sample(const msg::DragField& field, core::Nanoseconds received_ns,
                     std::uint64_t own_session) noexcept;
/// Contact as the phantom sees it: its worst sensor is at an object's surface.
PhantomContact to_sample(const msg::Percept& percept, core::Nanoseconds received_ns) noexcept;

/// Round trips: from this process's own stamps as they come back with drag_fields.
class RoundTrip {
 public:
  explicit RoundTrip(std::uint64_t own_session) : session_(own_session) {}
  /// Seconds since the master_state that the field goes back to was stamped; −1 if it is another process's,
  /// none, or one that was counted before.
  double measure(const msg::DragField& field, core::Nanoseconds received_ns) noexcept;

 private:
  std::uint64_t session_, last_ = 0;
};

/// Takes a command that is neither stop nor reset into `settings`. A refusal names what is allowed and leaves
/// them as they are. `round_trip_s`: the delay in force, with which 1/A must be stable.
core::Status take_setting(const msg::OperatorCommand& command, const GainRules& rules, double round_trip_s,
                          Settings& settings);

/// Everything of a master_state but its stamp.
msg::MasterState to_message(const MasterReport& report, std::size_t joint_count);

}  // namespace phantom::master_io

#pragma once

#include "common/core/status.hpp"
#include "components/master_io/dds_adapter.hpp"
#include "phantom_idl/teleoperation.h"

namespace phantom::master_io {

/// Why a sound drag_field is not what this master renders, naming what is allowed; empty if it is.
std::string refusal(const messages::DragField& field, teleop::DragMode rendered);
/// Contact as the phantom sees it: its worst sensor is at an object's surface.
PhantomContact contact_of(const messages::Percept& percept, core::Nanoseconds received_ns) noexcept;

/// Round trips: from this process's own stamps as they come back with drag_fields.
class RoundTrip {
 public:
  explicit RoundTrip(std::uint64_t own_session) : session_(own_session) {}
  /// Seconds since the master_state that the field goes back to was stamped; −1 if it is another process's,
  /// none, or one that was counted before.
  double measure(const messages::DragField& field, core::Nanoseconds received_ns) noexcept;

 private:
  std::uint64_t session_, last_ = 0;
};

/// Takes a command that is neither stop nor reset into `settings`. A refusal names what is allowed and leaves
/// them as they are. `round_trip_s`: the delay in force, with which 1/A must be stable.
core::Status take_setting(const msg::OperatorCommand& command, const GainRules& rules, double round_trip_s,
                          Settings& settings);

}  // namespace phantom::master_io

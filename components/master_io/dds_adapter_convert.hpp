#pragma once

#include "components/master_io/dds_adapter.hpp"

namespace phantom::master_io {

/// Returns why a valid drag_field cannot be rendered by this master, naming what is allowed; empty if it can
/// be.
std::string refusal(const messages::DragField& field, teleop::DragMode rendered);
/// Returns the contact that the phantom predicts (its worst sensor is at an object's surface), and how near
/// what it tells of is.
Vicinity vicinity_of(const messages::Percept& percept, core::Nanoseconds received_ns) noexcept;

/// Measures round trips from this process's own stamps as drag_fields return them.
class RoundTrip {
 public:
  explicit RoundTrip(std::uint64_t own_session) : session_(own_session) {}
  /// Returns the seconds since the stamp of the master_state from which the field was computed. Returns −1 if
  /// the field names none, one of another process, or one that was counted before.
  double measure(const messages::DragField& field, core::Nanoseconds received_ns) noexcept;

 private:
  std::uint64_t session_, last_ = 0;
};

/// Returns why a haptic device does not fit, naming the key and what is allowed; empty if it does. It needs
/// no moments or forces of axes along or about which it says that it cannot act.
std::string refusal(const messages::HapticDevice& device, const HapticNeeds& needs);

/// Returns what the servo needs of a view.
SeenView seen(const messages::ViewPose& view, core::Nanoseconds received_ns) noexcept;

}  // namespace phantom::master_io

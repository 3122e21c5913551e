#pragma once

#include <cmath>
#include <limits>

#include "components/synthetic_viewer/topics/dds_adapter.hpp"

namespace phantom::synthetic_viewer {

inline const messages::ArmBounds kShape{.joint_count = 7, .link_count = 8};
inline const double kNan = std::numeric_limits<double>::quiet_NaN();

inline msg::Stamp stamp(std::uint64_t number) {
  msg::Stamp made;
  made.sequence_number(number);
  made.session(5);
  return made;
}

/// Of a coupled arm of seven joints, valid.
inline msg::SlaveState slave_state() {
  msg::SlaveState message;
  message.stamp(stamp(1));
  message.state(msg::LinkState::LINK_COUPLED);
  message.joint_count(7);
  message.position_rad()[2] = 0.5;
  message.contact_force_N(-1);
  return message;
}

}  // namespace phantom::synthetic_viewer

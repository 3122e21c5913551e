#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "common/teleop/tests/servo_rig.hpp"
#include "components/master_io/config.hpp"
#include "components/master_io/dds_adapter.hpp"
#include "components/master_io/session.hpp"
#include "tests/support/files.hpp"
#include "tests/support/hot_cell.hpp"

namespace phantom::master_io {

inline const std::filesystem::path kShipped = PHANTOM_SOURCE_DIR "/components/master_io/master_io.yaml";

using test::hot_cell;
inline const ArmModel& shipped_arm() {
  static const auto model = load_arm(hot_cell(), "");
  return model;
}
inline Config shipped_config(const Choices& choices = {}) {
  return load_config(kShipped, hot_cell().file, shipped_arm().arm, shipped_arm().home, choices);
}

/// A file, if no other is named the shipped one, with one piece of text replaced.
inline std::filesystem::path changed(const std::string& from, const std::string& to,
                                     const std::filesystem::path& file = kShipped) {
  return test::changed(file, from, to);
}

/// The inputs of a servo with a slave that is coupled, and a drag that is everywhere the same.
struct ServoRig : teleop::ServoRig<Inbox, MasterReport> {
  SlaveSample slave;
  DragSample drag;

  ServoRig() {
    slave.state = teleop::LinkState::kCoupled;
    drag.drag.valid = true;
    drag.drag.plus.fill(0.02);
    drag.drag.minus.fill(0.02);
  }
};

}  // namespace phantom::master_io

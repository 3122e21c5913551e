#pragma once

#include <functional>
#include <memory>
#include <string>

#include "common/core/progress.hpp"
#include "common/core/snapshot.hpp"
#include "components/master_io/devices/desk.hpp"

namespace phantom::master_io {

/// Checks that the device that ManualInput would open is there. Throws core::MissingError as ManualInput
/// does.
void check_device(const DeskConfig& config);

/// Reads a stick, gamepad or keyboard on a thread of its own and drives its rumble motors. Not for the servo
/// thread, which reads the snapshot.
class ManualInput {
 public:
  struct Listener {
    std::function<void()> on_stop, on_reset;
    std::function<void(const std::string&)> notice;  ///< called with what a person should know
    std::function<void(bool open)> on_gripper;
    std::function<void(PerceptKey)> on_percepts;
  };

  /// Opens the device. The thread's priority is relative to `servo_priority`. Throws core::MissingError
  /// naming the device if it is missing or may not be read.
  ManualInput(const DeskConfig& config, core::Snapshot<DeskState>& state, Listener listener,
              int servo_priority);
  ~ManualInput();

  /// Sets the rumble's strength, 0…1, if the device can rumble. May be called by any thread but the servo's.
  void rumble(double strength);
  /// Returns the progress of the input thread.
  const core::Progress& progress() const;
  /// Returns the name of the opened device, for the log.
  const std::string& name() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace phantom::master_io

#pragma once

#include <functional>
#include <memory>
#include <string>

#include "common/core/progress.hpp"
#include "common/core/snapshot.hpp"
#include "components/master_io/desk.hpp"

namespace phantom::master_io {

/// Looks whether the device that DeskInput would open is there. Throws core::MissingError as that does.
void check_device(const DeskConfig& config);

/// Reads a stick, gamepad or keyboard on a thread of its own and lets it rumble. Not for the servo thread;
/// what it reads reaches that through the snapshot.
class DeskInput {
 public:
  struct Listener {
    std::function<void()> on_stop, on_reset;
    std::function<void(const std::string&)> notice;  ///< something a person should know
  };

  /// Opens the device. `servo_priority`: to which the thread's is relative. Throws core::MissingError naming
  /// the device if it is not there or may not be read.
  DeskInput(const DeskConfig& config, core::Snapshot<DeskState>& state, Listener listener,
            int servo_priority);
  ~DeskInput();

  /// Lets the device rumble with strength 0…1, if it can. Any thread but the servo's.
  void rumble(double strength);
  /// How its thread gets on.
  const core::Progress& progress() const;
  /// What was opened, for the log.
  const std::string& name() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace phantom::master_io

#pragma once

#include <linux/input.h>

#include <functional>
#include <memory>
#include <string>

#include "common/core/progress.hpp"
#include "common/runtime/servo/enabling_switch.hpp"

namespace phantom::runtime {

/// Decodes the kernel's events of the keys of an enabling switch: down and up; repetition is ignored. After a
/// lost event (SYN_DROPPED) the keys' state has to be read anew.
class SwitchDecoder {
 public:
  explicit SwitchDecoder(const SwitchKeys& keys) : keys_(keys) {}

  /// Returns whether the keys' state has to be read and given to set().
  bool take(const input_event& event) noexcept;
  void set(bool key, bool through_key) noexcept;
  void unplug() noexcept { reading_.contacts = {}; }
  const SwitchReading& reading() const noexcept { return reading_; }

 private:
  void set_key(bool down) noexcept;

  SwitchKeys keys_;
  SwitchReading reading_;
  bool lost_ = false;  // events up to the next report are of before the loss
};

/// Keys of an input device of this host as an enabling switch. A device that is missing or was unplugged is
/// looked for again every half second.
class SwitchDevice {
 public:
  /// What the kernel is asked for; a test gives its own.
  struct Kernel {
    /// Returns a descriptor of the device, and names it; −1: it is not there, and the name says why.
    std::function<int(const SwitchKeys&, std::string& name)> open;
    /// Returns 1 if the key is down, 0 if it is up, −1 if the device is gone.
    std::function<int(int fd, int key)> is_down;
  };
  static Kernel real();

  explicit SwitchDevice(const SwitchKeys& keys, Kernel kernel = real());
  ~SwitchDevice();
  SwitchDevice(const SwitchDevice&) = delete;
  SwitchDevice& operator=(const SwitchDevice&) = delete;

  /// Waits for an event, at most `timeout_ms`, and returns what the keys are then. Without an event the keys'
  /// state is read all the same, so that its age says whether the device is there. Not real-time safe.
  SwitchReading wait(int timeout_ms);
  /// Returns the device's name, or why there is none.
  const std::string& name() const { return name_; }
  bool plugged_in() const { return fd_ >= 0; }

 private:
  void look_for();
  bool take_events();
  bool read_state();
  void close_device();

  SwitchKeys keys_;
  Kernel kernel_;
  SwitchDecoder decoder_;
  int fd_ = -1;
  std::string name_;
  core::Nanoseconds looked_ns_ = 0;
};

/// Checks that the input device of a switch of that source is there. Throws core::MissingError naming it, and
/// what is allowed.
void check_switch(const std::optional<EnablingSwitchConfig>& config);

/// Reads an enabling switch on a thread of its own. Not for the servo thread, which reads the snapshot.
class SwitchInput {
 public:
  /// Returns the input of a switch of that source, and logs what the switch is; null for another source. It
  /// writes to `reader`, which must outlive it.
  static std::unique_ptr<SwitchInput> make(const std::optional<EnablingSwitchConfig>& config,
                                           SwitchReader& reader, int servo_priority);
  /// The thread's priority is relative to `servo_priority`. `into` must outlive the object.
  SwitchInput(const SwitchKeys& keys, core::Snapshot<SwitchReading>& into, int servo_priority);
  ~SwitchInput();
  const core::Progress& progress() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace phantom::runtime

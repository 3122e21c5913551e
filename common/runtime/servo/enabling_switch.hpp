#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/can/arm_drives.hpp"
#include "common/core/clock.hpp"
#include "common/core/snapshot.hpp"
#include "common/runtime/configuration/drives_config.hpp"
#include "common/runtime/configuration/fields.hpp"
#include "common/teleop/coupling/enabling_switch.hpp"

namespace phantom::runtime {

/// Keys of an input device that are an enabling switch.
struct SwitchKeys {
  std::string device =
      "auto";            ///< a file of /dev/input, the device's own name, or "auto": the first with the key
  int key = 0;           ///< down: held
  int through_key = -1;  ///< down: pressed through; −1: none
};

/// A contact on a digital input of a drive.
struct SwitchWire {
  int bit = -1;                  ///< of object 0x60FD; −1: not wired
  bool normally_closed = false;  ///< the input is off while the contact says held, or pressed through
};

/// Section `enabling_switch` of master_io.yaml and slave_io.yaml.
struct EnablingSwitchConfig {
  enum class Source { kInput, kDrive, kSimulated };
  Source source = Source::kInput;
  teleop::EnablingSwitchParameters parameters;
  SwitchKeys keys;
  SwitchWire first, second, through;  ///< source drive
  double hold_from_s = 0.5;           ///< source simulated: since the start
  std::vector<double> let_go_s;       ///< and let go at these times
  double let_go_for_s = 1.0;          ///< each time for so long
};

/// Parameter table enabling_switch.yaml of that section.
extern const char* const kSwitchParameters;

/// Reads the section; no value if the file has none. `can`: the side's drives, if it has any: the one that
/// the switch is wired to is then to send its digital inputs. Throws ConfigError naming file, line, key,
/// value and what is allowed.
std::optional<EnablingSwitchConfig> read_enabling_switch(const Fields& file,
                                                         std::optional<DrivesConfig>& can);

/// Returns the code of a key or button by its name in linux/input-event-codes.h, or by its number; −1:
/// unknown.
int key_code(const std::string& name);

/// What an input device's thread leaves for the servo.
struct SwitchReading {
  teleop::SwitchContacts contacts;  ///< without age
  core::Nanoseconds at_ns = 0;      ///< when the device was read
  std::uint32_t let_go = 0;         ///< how often it was let go so far, however short
};

/// Gives a side's servo the state of its enabling switch, whatever its source.
class SwitchReader {
 public:
  /// Without a configuration no switch is fitted.
  explicit SwitchReader(const std::optional<EnablingSwitchConfig>& config);

  /// `inputs`: the drives' digital inputs; `now_ns`: monotonic clock; `dt_s` since the last call. Real-time
  /// safe: yes.
  teleop::SwitchState step(const can::DigitalInputs& inputs, core::Nanoseconds now_ns, double dt_s) noexcept;

  core::Snapshot<SwitchReading> input;  ///< source input: written by SwitchInput

 private:
  teleop::SwitchContacts of_input(core::Nanoseconds now_ns) noexcept;
  teleop::SwitchContacts of_drive(const can::DigitalInputs& inputs, core::Nanoseconds now_ns) const noexcept;
  teleop::SwitchContacts of_script(double dt_s) noexcept;

  std::optional<EnablingSwitchConfig> config_;
  teleop::EnablingSwitch switch_;
  SwitchReading reading_;
  std::uint32_t let_go_seen_ = 0;
  double time_s_ = 0.0;  // since the start
};

}  // namespace phantom::runtime

#pragma once

#include <cstdint>
#include <limits>

#include "common/core/health.hpp"

namespace phantom::teleop {

/// An enabling switch as its source read it. A contact is true where it says that the switch is held, whether
/// it opens or closes then.
struct SwitchContacts {
  bool read = false;                   ///< false: its device is absent, unplugged or not heard yet
  bool first = false, second = false;  ///< a switch with one contact reports it twice
  bool through = false;                ///< it is pressed through, to its third position
  double age_s = std::numeric_limits<double>::infinity();  ///< since it was read
};

struct EnablingSwitchParameters {
  double settle_s = 0.02;      ///< contacts must stand so long before they count as held, or as released
  double stale_s = 0.1;        ///< contacts that are older count as absent
  double discrepancy_s = 0.5;  ///< the two contacts may differ so long before that is a fault
};

/// What an enabling switch says of motion.
enum class SwitchState : std::uint8_t {
  kNotFitted,       ///< this side has none: it permits
  kHeld,            ///< it permits
  kReleased,        ///< let go, or not held for long enough yet
  kToBeReleased,    ///< held, but it was not seen released since it was pressed through, absent or at fault
  kPressedThrough,  ///< in its third position
  kAbsent,          ///< its device is absent, unplugged or silent
  kContactsDiffer,  ///< one contact is stuck, or a wire is broken; lasts until both are seen released
};

/// Returns whether a side whose switch is in `state` permits motion.
constexpr bool permits(SwitchState state) noexcept {
  return state == SwitchState::kNotFitted || state == SwitchState::kHeld;
}

/// Returns in plain words why motion is not permitted, after "enabling switch "; empty if it is.
const char* reason_of(SwitchState state) noexcept;

/// Returns the component's state that belongs to a switch that does not permit: ready for one that is merely
/// let go, degraded for an absent one, fault for contacts that differ.
core::ComponentState component_state(SwitchState state) noexcept;

/// An enabling switch of three positions (released, held, pressed through; ISO 10218-1, IEC 60947-5-8), with
/// one contact or two: decides whether motion is permitted.
///
/// Letting go counts at once, on either contact; holding counts once both contacts have stood for settle_s.
/// Before it counts for the first time, and after it was pressed through, absent, stale, at fault or let go
/// on one contact only, both contacts must have been seen released for settle_s. So a switch that is tied
/// down permits nothing, and a contact that sticks cannot be overlooked. Deterministic, without side effects.
class EnablingSwitch {
 public:
  explicit EnablingSwitch(const EnablingSwitchParameters& parameters) : parameters_(parameters) {}

  /// Takes what was read last. Real-time safe: yes.
  SwitchState step(const SwitchContacts& contacts, double dt_s) noexcept;

 private:
  SwitchState refuse(SwitchState state) noexcept;

  EnablingSwitchParameters parameters_;
  double held_s_ = 0.0, released_s_ = 0.0, differ_s_ = 0.0;
  bool armed_ = false;    // it was seen released since it last had to be
  bool counted_ = false;  // it counts as held
  bool faulty_ = false;
};

}  // namespace phantom::teleop

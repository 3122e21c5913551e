#include "common/can/drive.hpp"
#include "common/core/text.hpp"

namespace phantom::can {

const char* name_of(DrivePhase phase) noexcept {
  constexpr const char* kNames[] = {"searching",  "configuring", "starting", "referencing",
                                    "homing",     "ready",       "enabling", "enabled",
                                    "quick stop", "resetting",   "fault"};
  return kNames[static_cast<std::size_t>(phase)];
}

namespace {

struct FaultText {
  const char* name;
  const char* sentence;  // after the drive's name
};
constexpr FaultText kFaults[] = {  // in the order of DriveFault
    {"none", "has no fault"},
    {"setup refused", ""},
    {"setup timeout", ""},
    {"not operational", "is not operational"},
    {"mode mismatch", ""},
    {"duplicate node", "shares its node id with another device on the bus"},
    {"PDO length", ""},
    {"feedback missing", "leaves SYNCs without an answer"},
    {"measurement missing", "tells its position, but not its speed and torque"},
    {"heartbeat lost", "lost: its heartbeat stopped"},
    {"rebooted", "restarted by itself"},
    {"bus-off", "cannot be reached: the CAN controller left the bus (bus-off)"},
    {"bus down", "cannot be reached: the CAN interface is down"},
    {"following error",
     "is too far from its target (following error): blocked, overloaded, or too narrow a window"},
    {"emergency", ""},
    {"drive fault", ""},
    {"enable timeout", "does not reach the commanded power state"},
    {"left enabled", "switched its power off by itself"},
    {"brake closed", "has not moved under its full torque since it got power: its brake may be closed"},
    {"homing error", "found no home: it reports a homing error"},
    {"homing timeout", "found no home in time"},
    {"implausible feedback", ""}};

std::string implausible_sentence(const ImplausibleMotion& m) {
  const char* unit = m.sliding ? "m" : "rad";
  switch (m.reason) {
    case Implausibility::kJump:
      return core::formatted(
          "reports a position that jumped by %.4g %s; between two answers at most %.4g is possible", m.seen,
          unit, m.allowed);
    case Implausibility::kOverspeed:
      return core::formatted("moves at %.4g %s/s by its position; allowed: at most %.4g", m.seen, unit,
                             m.allowed);
    case Implausibility::kVelocity:
      return core::formatted(
          "reports a velocity that does not fit its position: they differ by %.4g %s of way; allowed: at most %.4g",
          m.seen, unit, m.allowed);
    case Implausibility::kStuck:
      return core::formatted(
          "reports a constant position while its torque changed by %.3g of the greatest one; allowed: at "
          "most %.3g. Its encoder may be stuck",
          m.seen, m.allowed);
    case Implausibility::kFrozen:
      return core::formatted(
          "reports the same position and torque for %.3g s while its target changes; allowed: at most %.3g s. "
          "Its feedback may be frozen",
          m.seen, m.allowed);
    case Implausibility::kContrary:
      return core::formatted(
          "moved by %.4g %s away from its target; allowed: at most %.4g. Its feedback may be mirrored, or "
          "its polarity (0x607E) wrong",
          m.seen, unit, m.allowed);
    case Implausibility::kEnergy:
      return core::formatted(
          "gained %.4g J more than its torque gave it; allowed: at most %.4g. Its feedback may be mirrored, or "
          "something else drives the joint",
          m.seen, m.allowed);
    case Implausibility::kNone:
      break;
  }
  return "reports a motion that cannot be true";
}

/// What the object is for, and what helps where a drive refuses it: for the end of a sentence.
const char* advice_on(std::uint16_t index) {
  struct Advice {
    std::uint16_t first, last;
    const char* text;
  };
  constexpr Advice kAdvice[] = {
      {0x1016, 0x1016, "it has to watch the master's heartbeat: a drive that cannot is not permitted"},
      {0x1017, 0x1017, "it has to send a heartbeat: set it up for that, instead of node guarding"},
      {0x1400, 0x15FF, "it has to receive PDOs with each SYNC: free its PDOs in the drive's own software"},
      {0x1600, 0x17FF, "the targets have to be mapped: free its PDO mapping in the drive's own software"},
      {0x1800, 0x19FF, "it has to send PDOs with each SYNC: free its PDOs in the drive's own software"},
      {0x1A00, 0x1BFF, "its state has to be mapped: free its PDO mapping in the drive's own software"},
      {0x6007, 0x6007, "it has to stop by itself when the master is lost: update it, or use another drive"},
      {0x605A, 0x605A,
       "a quick stop has to end as configured (hold, or its brake): update it, or give it a brake"},
      {0x6040, 0x6040, "it takes no controlword: is it in remote operation, and no other master connected?"},
      {0x6060, 0x6060, "it takes no mode now: switch its power off, or choose another mode in can.drives"},
      {0x6065, 0x6066, "leave out following_window and following_time_s in can.drives"},
      {0x607D, 0x607D,
       "leave out limits_margin in can.drives, and set its limits in the drive's own software"},
      {0x6072, 0x6072, "it has to limit its torque: correct max_torque and the rated torque in can.drives"},
      {0x6076, 0x6076, "its rated torque has to be known: update it, or use another drive"},
      {0x607C, 0x609A, "it cannot be homed like this: correct homing in can.drives"}};
  for (const Advice& each : kAdvice)
    if (index >= each.first && index <= each.last) return each.text;
  return "see the drive's manual";
}

std::string setup_sentence(const DriveReport& r) {
  if (r.fault == DriveFault::kSetupTimeout)
    return core::formatted("does not answer for object 0x%04X:%u; %s", r.sdo_index, r.sdo_sub,
                           "is its node id right, and no other master asking it?");
  if (r.sdo_abort != 0)
    return core::formatted("refuses object 0x%04X:%u: %s (0x%08X); %s", r.sdo_index, r.sdo_sub,
                           sdo_abort_text(r.sdo_abort), r.sdo_abort, advice_on(r.sdo_index));
  const char* meaning =
      r.sdo_index == 0x1000 ? "it is no CiA 402 drive"
      : r.sdo_index == 0x6502
          ? "it does not support the configured mode (mode in can.drives)"
          : "not the configured rated torque in mN·m "
            "(in can.drives torque_constant times rated_current, or torque_sensitivity times rated_voltage)";
  return core::formatted("says %u (0x%X) for object 0x%04X: %s", r.sdo_value, r.sdo_value, r.sdo_index,
                         meaning);
}

std::string fault_sentence(const DriveReport& r) {
  switch (r.fault) {
    case DriveFault::kSetupRefused:
    case DriveFault::kSetupTimeout:
      return setup_sentence(r);
    case DriveFault::kModeMismatch:
      return "reports mode of operation " + std::to_string(r.mode) +
             " (0x6061), which was not commanded; where it needs longer to change: can.mode_timeout_s";
    case DriveFault::kPdoLength:
      return core::formatted(
          "sent a PDO of %u bytes where object 0x%04X maps %u: is another master configuring it, or is this "
          "mapping fixed in it?",
          r.pdo_bytes, r.pdo_mapping, r.mapped_bytes);
    case DriveFault::kImplausible:
      return implausible_sentence(r.implausible);
    case DriveFault::kEmergency:
    case DriveFault::kDriveFault:
      return core::formatted(
          "is in fault: %s (0x%04X)%s", emergency_text(r.emergency_code), r.emergency_code,
          r.unmoved ? "; it has not moved since it got power: its brake may be closed" : "");
    default:
      return kFaults[static_cast<std::size_t>(r.fault)].sentence;
  }
}

}  // namespace

const char* name_of(DriveFault fault) noexcept { return kFaults[static_cast<std::size_t>(fault)].name; }

std::string describe(const DriveReport& report, const std::string& name) {
  if (report.phase == DrivePhase::kFault) return name + " " + fault_sentence(report);
  if (report.phase == DrivePhase::kReferencing && report.needs_homing) return name + " has to be homed";
  if (report.phase == DrivePhase::kSearching) return name + " has not answered yet";
  return name + " is " + (report.phase == DrivePhase::kQuickStop ? "in " : "") + name_of(report.phase);
}

}  // namespace phantom::can

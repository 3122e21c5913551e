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
    {"PDO length", "sent a PDO of another length than was mapped"},
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
    case Implausibility::kNone:
      break;
  }
  return "reports a motion that cannot be true";
}

std::string setup_sentence(const DriveReport& r) {
  if (r.fault == DriveFault::kSetupTimeout)
    return core::formatted("does not answer for object 0x%04X:%u", r.sdo_index, r.sdo_sub);
  if (r.sdo_abort != 0)
    return core::formatted("refuses object 0x%04X:%u: %s (0x%08X)", r.sdo_index, r.sdo_sub,
                           sdo_abort_text(r.sdo_abort), r.sdo_abort);
  const char* meaning = r.sdo_index == 0x1000   ? "it is no CiA 402 drive"
                        : r.sdo_index == 0x6502 ? "it does not support the configured mode"
                                                : "not the configured rated torque (mN·m)";
  return core::formatted("says %u (0x%X) for object 0x%04X: %s", r.sdo_value, r.sdo_value, r.sdo_index,
                         meaning);
}

std::string fault_sentence(const DriveReport& r) {
  switch (r.fault) {
    case DriveFault::kSetupRefused:
    case DriveFault::kSetupTimeout:
      return setup_sentence(r);
    case DriveFault::kModeMismatch:
      return "reports mode of operation " + std::to_string(r.mode) + ", which was not commanded";
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

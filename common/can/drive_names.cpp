#include <cstdio>

#include "common/can/drive.hpp"

namespace phantom::can {

const char* name_of(DrivePhase phase) noexcept {
  constexpr const char* kNames[] = {"searching", "configuring", "starting",  "ready", "enabling",
                                    "enabled",   "quick stop",  "resetting", "fault"};
  return kNames[static_cast<std::size_t>(phase)];
}

const char* name_of(DriveFault fault) noexcept {
  constexpr const char* kNames[] = {
      "none",           "setup refused", "setup timeout",    "not operational",     "mode mismatch",
      "duplicate node", "PDO length",    "feedback missing", "measurement missing", "heartbeat lost",
      "rebooted",       "bus-off",       "bus down",         "emergency",           "drive fault",
      "enable timeout", "left enabled"};
  return kNames[static_cast<std::size_t>(fault)];
}

namespace {

std::string setup_sentence(const DriveReport& r) {
  char text[160];
  if (r.fault == DriveFault::kSetupTimeout) {
    std::snprintf(text, sizeof text, "does not answer for object 0x%04X:%u", r.sdo_index, r.sdo_sub);
  } else if (r.sdo_abort != 0) {
    std::snprintf(text, sizeof text, "refuses object 0x%04X:%u: %s (0x%08X)", r.sdo_index, r.sdo_sub,
                  sdo_abort_text(r.sdo_abort), r.sdo_abort);
  } else {
    const char* meaning = r.sdo_index == 0x1000   ? "it is no CiA 402 drive"
                          : r.sdo_index == 0x6502 ? "it does not support the configured mode"
                                                  : "not the configured rated torque (mN·m)";
    std::snprintf(text, sizeof text, "says %u (0x%X) for object 0x%04X: %s", r.sdo_value, r.sdo_value,
                  r.sdo_index, meaning);
  }
  return text;
}

std::string fault_sentence(const DriveReport& r) {
  switch (r.fault) {
    case DriveFault::kSetupRefused:
    case DriveFault::kSetupTimeout:
      return setup_sentence(r);
    case DriveFault::kNotOperational:
      return "is not operational";
    case DriveFault::kModeMismatch:
      return "reports mode of operation " + std::to_string(r.mode) + ", which was not commanded";
    case DriveFault::kDuplicateNode:
      return "shares its node id with another device on the bus";
    case DriveFault::kPdoLength:
      return "sent a PDO of another length than was mapped";
    case DriveFault::kFeedbackMissing:
      return "leaves SYNCs without an answer";
    case DriveFault::kMeasurementMissing:
      return "tells its position, but not its speed and torque";
    case DriveFault::kHeartbeatLost:
      return "is not heard: its heartbeat stopped";
    case DriveFault::kRebooted:
      return "started anew by itself";
    case DriveFault::kBusOff:
      return "cannot be reached: the CAN controller left the bus (bus-off)";
    case DriveFault::kBusDown:
      return "cannot be reached: the CAN interface is down";
    case DriveFault::kEmergency:
    case DriveFault::kDriveFault: {
      char code[16];
      std::snprintf(code, sizeof code, "0x%04X", r.emergency_code);
      return std::string("is in fault: ") + emergency_text(r.emergency_code) + " (" + code + ")";
    }
    case DriveFault::kEnableTimeout:
      return "does not reach the commanded power state";
    case DriveFault::kLeftEnabled:
      return "switched its power off by itself";
    case DriveFault::kNone:
      break;
  }
  return "has no fault";
}

}  // namespace

std::string describe(const DriveReport& report, const std::string& name) {
  if (report.phase == DrivePhase::kFault) return name + " " + fault_sentence(report);
  if (report.phase == DrivePhase::kSearching) return name + " has not answered yet";
  return name + " is " + (report.phase == DrivePhase::kQuickStop ? "in " : "") + name_of(report.phase);
}

}  // namespace phantom::can

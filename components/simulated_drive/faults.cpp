#include "components/simulated_drive/faults.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "common/core/errors.hpp"

namespace phantom::simulated_drive {
namespace {

struct Kind {
  const char* name;
  const char* text;
  void (*apply)(SimulatedDrive&);
};

constexpr Kind kKinds[] = {
    {"heartbeat", "its heartbeat stops", [](SimulatedDrive& d) { d.misbehaviour.mute_heartbeat = true; }},
    {"pdos", "it answers no SYNC", [](SimulatedDrive& d) { d.misbehaviour.mute_pdos = true; }},
    {"measurement", "its speed and torque are no longer sent",
     [](SimulatedDrive& d) { d.misbehaviour.mute_measurement = true; }},
    {"sdo", "it answers no SDO", [](SimulatedDrive& d) { d.misbehaviour.mute_sdo = true; }},
    {"mode", "it reports profile position mode", [](SimulatedDrive& d) { d.misbehaviour.shown_mode = 1; }},
    {"length", "its PDOs are a byte short", [](SimulatedDrive& d) { d.misbehaviour.cut_pdo_bytes = 1; }},
    {"trip", "over-current: emergency message and fault", [](SimulatedDrive& d) { d.trip(0x2310); }},
    {"warn", "emergency message without fault", [](SimulatedDrive& d) { d.warn(0x4310); }},
    {"reboot", "its logic supply fails for a moment", [](SimulatedDrive& d) { d.power_cycle(); }},
    {"brake", "its brake no longer opens", [](SimulatedDrive& d) { d.misbehaviour.keep_brake = true; }},
    {"hold", "the enabling switch on its terminals is held (enabling_bits)",
     [](SimulatedDrive& d) { d.hold_switch(true); }},
    {"let_go", "that switch is released", [](SimulatedDrive& d) { d.hold_switch(false); }},
    {"inputs", "its digital inputs are no longer sent",
     [](SimulatedDrive& d) { d.misbehaviour.mute_inputs = true; }},
    {"stuck", "one contact of its enabling switch sticks", [](SimulatedDrive& d) { d.stick_contact(); }},
    {"power", "its power stage loses its supply", [](SimulatedDrive& d) { d.cut_power(); }},
    {"encoder_stuck", "its position stays, its speed is 0, whatever it does",
     [](SimulatedDrive& d) { d.misbehaviour.stuck_encoder = true; }},
    {"encoder_mirrored", "its encoder counts the other way",
     [](SimulatedDrive& d) { d.misbehaviour.mirrored_encoder = true; }},
    {"encoder_jump", "its position jumps by half of its range of numbers",
     [](SimulatedDrive& d) { d.misbehaviour.count_jump = std::int64_t{1} << 31; }},
    {"speed_negated", "its speed has the wrong sign",
     [](SimulatedDrive& d) { d.misbehaviour.negated_velocity = true; }},
    {"speed_garbage", "its speed is random, up to 10 rad/s of the motor",
     [](SimulatedDrive& d) { d.misbehaviour.garbage_speed_rad_s = 10.0; }},
};

}  // namespace

std::string fault_help() {
  std::string help;
  for (const Kind& kind : kKinds) help += std::string("  ") + kind.name + ": " + kind.text + "\n";
  return help;
}

TimedFault parse_fault(const std::string& text) {
  const auto at = text.find('@');
  TimedFault fault{.kind = text.substr(0, at)};
  const bool known =
      std::any_of(std::begin(kKinds), std::end(kKinds), [&](const Kind& k) { return fault.kind == k.name; });
  char* end = nullptr;
  if (at != std::string::npos) fault.at_s = std::strtod(text.c_str() + at + 1, &end);
  if (end != nullptr && *end == ':') fault.node = static_cast<int>(std::strtol(end + 1, &end, 10));
  if (!known || end == nullptr || *end != '\0' || !std::isfinite(fault.at_s) || fault.at_s < 0 ||
      fault.node < 0)
    throw core::ConfigError("--fault '" + text +
                            "'; allowed: KIND@SECONDS or KIND@SECONDS:NODE with one of\n" + fault_help());
  return fault;
}

void apply(const std::string& kind, SimulatedDrive& drive) {
  for (const Kind& k : kKinds) {
    if (kind == k.name) k.apply(drive);
  }
}

}  // namespace phantom::simulated_drive

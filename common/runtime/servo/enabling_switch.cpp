#include "common/runtime/servo/enabling_switch.hpp"

#include <linux/input-event-codes.h>

#include <algorithm>
#include <cstdlib>

#include "common/core/text.hpp"

namespace phantom::runtime {
namespace {

using teleop::SwitchContacts;
using Source = EnablingSwitchConfig::Source;

// Those that pads, joysticks, pedals and keyboards have for it; others by their number.
constexpr struct {
  const char* name;
  int code;
} kKeys[] = {{"BTN_SOUTH", BTN_SOUTH},
             {"BTN_EAST", BTN_EAST},
             {"BTN_NORTH", BTN_NORTH},
             {"BTN_WEST", BTN_WEST},
             {"BTN_TL", BTN_TL},
             {"BTN_TR", BTN_TR},
             {"BTN_TL2", BTN_TL2},
             {"BTN_TR2", BTN_TR2},
             {"BTN_THUMBL", BTN_THUMBL},
             {"BTN_THUMBR", BTN_THUMBR},
             {"BTN_TRIGGER", BTN_TRIGGER},
             {"BTN_THUMB", BTN_THUMB},
             {"BTN_THUMB2", BTN_THUMB2},
             {"BTN_TOP", BTN_TOP},
             {"BTN_TOP2", BTN_TOP2},
             {"BTN_PINKIE", BTN_PINKIE},
             {"BTN_BASE", BTN_BASE},
             {"BTN_BASE2", BTN_BASE2},
             {"BTN_0", BTN_0},
             {"BTN_1", BTN_1},
             {"BTN_2", BTN_2},
             {"BTN_LEFT", BTN_LEFT},
             {"BTN_RIGHT", BTN_RIGHT},
             {"BTN_MIDDLE", BTN_MIDDLE},
             {"KEY_A", KEY_A},
             {"KEY_B", KEY_B},
             {"KEY_C", KEY_C},
             {"KEY_LEFTCTRL", KEY_LEFTCTRL},
             {"KEY_RIGHTCTRL", KEY_RIGHTCTRL},
             {"KEY_SPACE", KEY_SPACE},
             {"KEY_F13", KEY_F13},
             {"KEY_F14", KEY_F14},
             {"KEY_F15", KEY_F15}};

int read_key(const Fields& section, const std::string& key, int code) {
  std::string name;
  section.text(key, name);
  if (name.empty()) return code;
  code = key_code(name);
  section.check(
      code >= 0, key,
      "is no key that is known by name; allowed: BTN_THUMBR and the like, KEY_F13 and the like, or the "
      "number of any key in linux/input-event-codes.h");
  return code;
}

void read_wire(const Fields& section, const std::string& bit, const std::string& contact, SwitchWire& wire) {
  section.number(bit, wire.bit);
  section.choice(contact, wire.normally_closed, {{"normally_open", false}, {"normally_closed", true}});
  section.check(wire.bit >= 0 || !section.has(contact), contact,
                "is of no input; allowed: together with " + bit);
}

void read_wires(const Fields& section, std::optional<DrivesConfig>& can, EnablingSwitchConfig& config) {
  std::string drive;
  section.text("drive", drive);
  config.first.bit = 16;
  read_wire(section, "bit", "contact", config.first);
  read_wire(section, "second_bit", "second_contact", config.second);
  read_wire(section, "through_bit", "through_contact", config.through);
  if (config.source != Source::kDrive) return;
  section.check(can.has_value(), "source",
                "needs drives on CAN; allowed: input, simulated, or drive with driver can");
  auto& axes = can->group.axes;
  const auto axis = std::ranges::find(axes, drive, &can::AxisConfig::name);
  section.check(axis != axes.end(), "drive",
                "is no joint; allowed: " + core::listed(axes, &can::AxisConfig::name));
  section.check(config.second.bit != config.first.bit, "second_bit",
                "is that of the first contact; allowed: another");
  section.check(config.through.bit < 0 ||
                    (config.through.bit != config.first.bit && config.through.bit != config.second.bit),
                "through_bit", "is that of another contact; allowed: one of its own");
  axis->digital_inputs = true;
  const core::Status status = can::check(can->group);
  section.check(static_cast<bool>(status), "drive", status ? "" : status.message());
}

bool is_on(const SwitchWire& wire, std::uint32_t bits) noexcept {
  return ((bits >> static_cast<unsigned>(wire.bit) & 1U) != 0) != wire.normally_closed;
}

}  // namespace

int key_code(const std::string& name) {
  for (const auto& key : kKeys) {
    if (name == key.name) return key.code;
  }
  char* end = nullptr;
  const long number = std::strtol(name.c_str(), &end, 0);
  return !name.empty() && *end == '\0' && number > 0 && number < KEY_CNT ? static_cast<int>(number) : -1;
}

std::optional<EnablingSwitchConfig> read_enabling_switch(const Fields& file,
                                                         std::optional<DrivesConfig>& can) {
  if (!file.has("enabling_switch")) return std::nullopt;
  const Fields section = file.section("enabling_switch");
  EnablingSwitchConfig config;
  section.choice("source", config.source,
                 {{"input", Source::kInput}, {"drive", Source::kDrive}, {"simulated", Source::kSimulated}});
  section.number("settle_s", config.parameters.settle_s);
  section.number("stale_s", config.parameters.stale_s);
  section.number("discrepancy_s", config.parameters.discrepancy_s);
  section.text("device", config.keys.device);
  config.keys.key = read_key(section, "key", BTN_THUMBR);
  config.keys.through_key = read_key(section, "through_key", -1);
  section.check(config.keys.through_key != config.keys.key, "through_key",
                "is also the key; allowed: another one");
  read_wires(section, can, config);
  section.number("hold_from_s", config.hold_from_s);
  section.numbers("let_go_s", config.let_go_s);
  section.number("let_go_for_s", config.let_go_for_s);
  return config;
}

SwitchReader::SwitchReader(const std::optional<EnablingSwitchConfig>& config)
    : config_(config), switch_(config ? config->parameters : teleop::EnablingSwitchParameters()) {}

SwitchContacts SwitchReader::of_input(core::Nanoseconds now_ns) noexcept {
  input.read(reading_);
  SwitchContacts contacts = reading_.contacts;
  contacts.age_s = core::seconds(now_ns - reading_.at_ns);
  // Let go and held again between two ticks: it counts for one.
  if (reading_.let_go != let_go_seen_) contacts.first = contacts.second = false;
  let_go_seen_ = reading_.let_go;
  return contacts;
}

SwitchContacts SwitchReader::of_drive(const can::DigitalInputs& inputs,
                                      core::Nanoseconds now_ns) const noexcept {
  SwitchContacts contacts{.read = inputs.at_ns != 0, .age_s = core::seconds(now_ns - inputs.at_ns)};
  contacts.first = is_on(config_->first, inputs.bits);
  contacts.second = config_->second.bit < 0 ? contacts.first : is_on(config_->second, inputs.bits);
  contacts.through = config_->through.bit >= 0 && is_on(config_->through, inputs.bits);
  return contacts;
}

SwitchContacts SwitchReader::of_script(double dt_s) noexcept {
  time_s_ += dt_s;
  const bool let_go = std::any_of(config_->let_go_s.begin(), config_->let_go_s.end(), [this](double from_s) {
    return time_s_ >= from_s && time_s_ < from_s + config_->let_go_for_s;
  });
  const bool held = time_s_ >= config_->hold_from_s && !let_go;
  return {.read = true, .first = held, .second = held, .age_s = 0.0};
}

teleop::SwitchState SwitchReader::step(const can::DigitalInputs& inputs, core::Nanoseconds now_ns,
                                       double dt_s) noexcept {
  if (!config_) return teleop::SwitchState::kNotFitted;
  switch (config_->source) {
    case Source::kInput:
      return switch_.step(of_input(now_ns), dt_s);
    case Source::kDrive:
      return switch_.step(of_drive(inputs, now_ns), dt_s);
    default:
      return switch_.step(of_script(dt_s), dt_s);
  }
}

}  // namespace phantom::runtime

#include "common/runtime/configuration/drives_check.hpp"

#include <spdlog/fmt/fmt.h>

#include "common/can/sdo_client.hpp"
#include "common/can/user_bus.hpp"
#include "common/core/clock.hpp"

namespace phantom::runtime {
namespace {

constexpr core::Nanoseconds kListen_ns = core::from_seconds(0.3);
constexpr std::uint32_t kCia402 = 402;

/// Whether a master serves the bus: it sends SYNC every cycle, and heartbeats.
bool master_is_heard(can::CanBus& bus, int master_node) {
  const core::Nanoseconds until_ns = core::monotonic_ns() + kListen_ns;
  can::Received received;
  while (core::monotonic_ns() < until_ns) {
    bus.wait(until_ns - core::monotonic_ns());
    while (bus.receive(received)) {
      const std::uint32_t id = received.frame.id;
      if (received.is_frame() &&
          (id == can::kCobSync || id == can::kCobHeartbeat + static_cast<std::uint32_t>(master_node)))
        return true;
    }
  }
  return false;
}

/// One object of up to four octets; nothing if there is no answer in time, or none such object.
std::optional<std::uint32_t> read_object(can::CanBus& bus, std::uint8_t node, std::uint16_t index,
                                         std::uint8_t sub, core::Nanoseconds timeout_ns) {
  can::SdoClient client(node, timeout_ns);
  client.start_read(index, sub, core::monotonic_ns());
  while (client.state() == can::SdoClient::State::kBusy) {
    if (const auto frame = client.poll(core::monotonic_ns())) bus.send(*frame);
    bus.wait(core::from_seconds(0.002));
    can::Received received;
    while (bus.receive(received))
      if (received.is_frame()) client.on_frame(received.frame, core::monotonic_ns());
  }
  if (client.state() != can::SdoClient::State::kDone || client.data().size() > 4) return std::nullopt;
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < client.data().size(); ++i)
    value |= static_cast<std::uint32_t>(client.data()[i]) << 8 * i;
  return value;
}

std::string look_at(can::CanBus& bus, const can::AxisConfig& axis, double timeout_s) {
  const auto read = [&](std::uint16_t index, std::uint8_t sub) {
    return read_object(bus, static_cast<std::uint8_t>(axis.node), index, sub, core::from_seconds(timeout_s));
  };
  const std::string who = fmt::format("{}, node {} on {}", axis.name, axis.node, bus.address());
  const auto type = read(0x1000, 0);
  if (!type)
    throw MissingError(fmt::format("{}: no answer within {} s; is it powered, and is its node number right?",
                                   who, timeout_s));
  if ((*type & 0xffff) != kCia402)
    throw ConfigError(
        fmt::format("{}: it is no CiA 402 drive (device type {:#010x}); allowed: one", who, *type));
  return fmt::format("\n  {}: vendor {:#x}, product {:#x}", who, read(0x1018, 1).value_or(0),
                     read(0x1018, 2).value_or(0));
}

}  // namespace

std::string check_drives(const DrivesConfig& config) {
  std::string found;
  for (std::size_t b = 0; b < config.addresses.size(); ++b) {
    const std::string& address = config.addresses[b];
    auto opened = can::open_bus(address);
    if (!opened && can::is_user_address(address) && opened.status().code() == core::ErrorCode::kNotFound) {
      found += "\n  " + address + ": not there yet; a simulated_drive makes it";
      continue;
    }
    if (!opened && opened.status().code() == core::ErrorCode::kNotFound)
      throw MissingError(opened.status().message());
    if (!opened) throw ConfigError(opened.status().message());
    can::CanBus& bus = *opened.value();
    if (bus.state() == can::BusState::kDown) throw MissingError(address + ": the interface is down");
    if (master_is_heard(bus, config.group.master_node)) {
      found += "\n  " + address + ": a master serves it; its drives were not asked";
      continue;
    }
    for (const can::AxisConfig& axis : config.group.axes)
      if (axis.bus == b) found += look_at(bus, axis, config.group.timing.sdo_timeout_s);
  }
  return found;
}

}  // namespace phantom::runtime

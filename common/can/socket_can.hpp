#pragma once

#include "common/can/can_bus.hpp"

namespace phantom::can {

/// Opens a SocketCAN interface (raw socket, error frames on, kernel receive time stamps). The interface must
/// be up and configured: the system sets bit rate and restart time (`ip link set can0 up type can bitrate
/// 1000000 restart-ms 100`). restart() takes the interface down and up, which needs CAP_NET_ADMIN; with
/// restart-ms the kernel restarts it by itself. Errors: kNotFound (no CAN in this kernel, no such interface,
/// down).
core::Expected<std::unique_ptr<CanBus>> open_socket_can(const std::string& interface);

}  // namespace phantom::can

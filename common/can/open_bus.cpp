#include "common/can/can_bus.hpp"
#include "common/can/socket_can.hpp"
#include "common/can/user_bus.hpp"

namespace phantom::can {

core::Expected<std::unique_ptr<CanBus>> open_bus(const std::string& address) {
  if (is_user_address(address)) return open_user_bus(address);
  return open_socket_can(address);
}

}  // namespace phantom::can

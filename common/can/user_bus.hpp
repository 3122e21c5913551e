#pragma once

#include <memory>
#include <string>

#include "common/can/can_bus.hpp"

namespace phantom::can {

/// Returns whether `address` names a userspace bus ("user:NAME").
bool is_user_address(const std::string& address) noexcept;

/// Connects to the userspace bus "user:NAME". Errors: kNotFound if nobody serves it; kInvalidArgument.
core::Expected<std::unique_ptr<CanBus>> open_user_bus(const std::string& address);

}  // namespace phantom::can

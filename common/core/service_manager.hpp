#pragma once

#include <string>

namespace phantom::core {

/// Notifies the service manager that started this process (systemd, by the datagram protocol of sd_notify)
/// that it is up, alive, and what it is doing: READY=1, WATCHDOG=1 and STATUS=`status`. Leaves WATCHDOG=1 out
/// if `alive` is false, so that the manager restarts a process that stays not alive. Does nothing if there is
/// no manager ($NOTIFY_SOCKET unset). Never blocks; drops a message for which the socket has no room.
/// Thread-safe, not real-time safe.
void notify_service_manager(const std::string& status, bool alive = true);

}  // namespace phantom::core

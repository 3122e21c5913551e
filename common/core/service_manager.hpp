#pragma once

#include <string>

namespace phantom::core {

/// Tells the service manager that started this process (systemd, by the datagram protocol of sd_notify) that
/// it is up, alive, and what it is doing: READY=1, WATCHDOG=1 and STATUS=`status`. Where `alive` is false,
/// WATCHDOG=1 is left out, so that a process that goes on not being alive is ended and started again. Does
/// nothing if there is no manager ($NOTIFY_SOCKET unset). Never blocks; a message that finds no room is
/// dropped. Thread-safe, not real-time safe.
void notify_service_manager(const std::string& status, bool alive = true);

}  // namespace phantom::core

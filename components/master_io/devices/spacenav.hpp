#pragma once

#include <memory>

#include "components/master_io/devices/desk_decode.hpp"

namespace phantom::master_io {

/// A connection to spacenavd, the free daemon of space mice, by libspnav. A process has one at a time. For
/// the desk's thread: connecting may wait for the daemon, reading never does.
class Spacenav {
 public:
  /// Returns whether this build has libspnav.
  static bool built_in() noexcept;
  /// Connects; null if nobody serves the daemon's socket ($SPNAV_SOCKET, /etc/spnavrc, /var/run/spnav.sock).
  static std::unique_ptr<Spacenav> connect();
  ~Spacenav();
  Spacenav(const Spacenav&) = delete;
  Spacenav& operator=(const Spacenav&) = delete;

  /// Waits for events for `wait_ms` at most and hands on those that are there. Returns false once the daemon
  /// is gone.
  bool read(int wait_ms, double now_s, SpacenavDecoder& decoder);

 private:
  Spacenav() = default;
};

}  // namespace phantom::master_io

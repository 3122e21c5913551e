#include "components/master_io/devices/spacenav.hpp"

#ifdef PHANTOM_SPNAV
#include <poll.h>
#include <spnav.h>
#endif

namespace phantom::master_io {

#ifdef PHANTOM_SPNAV

bool Spacenav::built_in() noexcept { return true; }

std::unique_ptr<Spacenav> Spacenav::connect() {
  if (spnav_open() != 0) return nullptr;
  return std::unique_ptr<Spacenav>(new Spacenav());
}

Spacenav::~Spacenav() { spnav_close(); }

bool Spacenav::read(int wait_ms, double now_s, SpacenavDecoder& decoder) {
  pollfd wait{spnav_fd(), POLLIN | POLLRDHUP, 0};
  if (poll(&wait, 1, wait_ms) <= 0) return true;
  constexpr int kMaxAtOnce = 64;  // whoever floods is read on in the next turn
  spnav_event event;
  for (int i = 0; i < kMaxAtOnce && spnav_poll_event(&event) != 0; ++i) {
    if (event.type == SPNAV_EVENT_MOTION) {
      const spnav_event_motion& m = event.motion;
      decoder.deflect({m.x, m.y, m.z, m.rx, m.ry, m.rz}, now_s);
    } else if (event.type == SPNAV_EVENT_BUTTON) {
      decoder.press(event.button.bnum, event.button.press != 0);
    }
  }
  return (wait.revents & (POLLHUP | POLLRDHUP | POLLERR | POLLNVAL)) == 0;
}

#else

bool Spacenav::built_in() noexcept { return false; }
std::unique_ptr<Spacenav> Spacenav::connect() { return nullptr; }
Spacenav::~Spacenav() = default;
bool Spacenav::read(int, double, SpacenavDecoder&) { return false; }

#endif

}  // namespace phantom::master_io

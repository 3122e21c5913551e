/* The header is plain C, and its functions have C linkage. */
#include "phantom_haptic_device.h"

int sends_from_c(phantom_haptic_device* device) {
  struct phantom_haptic_state state = {{0.0, 0.0, 0.0}, {0.0, 0.0, 0.0, 1.0}, {0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}, 1, 0, 0, -1.0};
  struct phantom_haptic_wrench wrench;
  phantom_haptic_device_receive(device, &wrench);
  return phantom_haptic_device_send(device, &state);
}

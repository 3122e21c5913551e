/* A process that serves a haptic device to Phantom. The device is simulated here: a handle with mass and damping, and a
 * hand that swings it. Replace `struct device` and the two functions below by the calls of your device's SDK.
 *
 *   cc -std=c99 haptic_device_example.c $(pkg-config --cflags --libs phantom-haptic-device) -lm -o haptic_device_example
 *   haptic_device_example --deployment /usr/share/phantom/deploy/topologies/haptic_device.yaml */
#define _POSIX_C_SOURCE 200809L
#include <math.h>
#include <phantom_haptic_device.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

#define PERIOD_S 0.001

static volatile sig_atomic_t ends;
static void on_signal(int number) {
  (void)number;
  ends = 1;
}

/* ---- the device: replace from here ---- */
static const struct phantom_haptic_abilities abilities = {
    PHANTOM_HAPTIC_POSITION | PHANTOM_HAPTIC_ORIENTATION, /* measured */
    PHANTOM_HAPTIC_POSITION | PHANTOM_HAPTIC_ORIENTATION, /* actuated */
    15.0, 1.0,   /* N, N m */
    1.0,  0.02,  /* kg, kg m2 */
    0.15, 1.2,   /* m, rad */
    PERIOD_S};

struct device {
  double x_m[3], v_m_s[3];
  double swing_s; /* for how long the hand has swung */
  int clutch;
};

/* What an SDK's "get pose, velocity and buttons" gives. */
static void device_read(const struct device* device, struct phantom_haptic_state* state) {
  memset(state, 0, sizeof *state);
  memcpy(state->position_m, device->x_m, sizeof device->x_m);
  memcpy(state->velocity_m_s, device->v_m_s, sizeof device->v_m_s);
  state->orientation_xyzw[3] = 1.0; /* the hand does not turn it */
  state->ready = 1;
  state->clutch = device->clutch;
  state->grip_opening = -1.0;
}

/* What an SDK's "set force and moment" gets; here the simulated handle also moves on. The hand draws it along a swing of
 * up to 8 cm, at 0.4 Hz, with 300 N/m, while it holds the clutch in. */
static void device_write(struct device* device, const struct phantom_haptic_wrench* wrench) {
  static const double way_m[3] = {0.03, 0.08, 0.05};
  int i;
  device->swing_s = device->clutch ? device->swing_s + PERIOD_S : 0.0;
  for (i = 0; i < 3; ++i) {
    const double start = fmin(1.0, device->swing_s);
    const double aim_m = start * way_m[i] * sin(6.2832 * 0.4 * device->swing_s);
    double hand_N = device->clutch ? 300.0 * (aim_m - device->x_m[i]) - 35.0 * device->v_m_s[i]
                                   : -60.0 * device->v_m_s[i];
    hand_N = fmax(-12.0, fmin(12.0, hand_N));
    device->v_m_s[i] +=
        PERIOD_S / abilities.mass_kg * (hand_N + wrench->force_N[i] - 1.0 * device->v_m_s[i]);
    device->x_m[i] += PERIOD_S * device->v_m_s[i];
  }
}
/* ---- to here ---- */

int main(int argc, char* argv[]) {
  char why[512];
  struct device device;
  struct phantom_haptic_state state;
  struct phantom_haptic_wrench wrench;
  struct timespec next;
  double valid_s = 0.0, energy_J = 0.0;
  long tick;
  phantom_haptic_device* phantom = phantom_haptic_device_open(argc, argv, &abilities, why, sizeof why);
  if (phantom == NULL) {
    fprintf(stderr, "haptic_device_example: %s\n", why);
    return 2;
  }
  printf("a SIMULATED haptic device, swung by a simulated hand\n");
  signal(SIGINT, on_signal);
  signal(SIGTERM, on_signal);
  memset(&device, 0, sizeof device);
  clock_gettime(CLOCK_MONOTONIC, &next);
  for (tick = 0; !ends; ++tick) {
    phantom_haptic_device_receive(phantom, &wrench); /* 1. what the hand is to feel: never blocks */
    device_write(&device, &wrench);                  /* 2. exert it for one period */
    device_read(&device, &state);                    /* 3. measure */
    if (phantom_haptic_device_send(phantom, &state) != 0) { /* 4. say what the hand does */
      fprintf(stderr, "haptic_device_example: %s\n", phantom_haptic_device_why(phantom));
      break;
    }
    /* A person lets the clutch out when Phantom lets go, and in again a second after it is back. */
    valid_s = wrench.valid ? valid_s + PERIOD_S : 0.0;
    device.clutch = valid_s > 1.0;
    energy_J -= PERIOD_S * (wrench.force_N[0] * device.v_m_s[0] + wrench.force_N[1] * device.v_m_s[1] +
                            wrench.force_N[2] * device.v_m_s[2]);
    if (tick % 1000 == 0) {
      printf("%s, %.2f N, %.3f J taken from the hand, answered in %.2f ms\n",
             wrench.leads ? "leads" : wrench.valid ? "taken" : "not taken",
             sqrt(wrench.force_N[0] * wrench.force_N[0] + wrench.force_N[1] * wrench.force_N[1] +
                  wrench.force_N[2] * wrench.force_N[2]),
             energy_J, 1e3 * fmax(0.0, wrench.answer_s));
      fflush(stdout);
    }
    next.tv_nsec += (long)(1e9 * PERIOD_S);
    if (next.tv_nsec >= 1000000000L) {
      next.tv_nsec -= 1000000000L;
      ++next.tv_sec;
    }
    clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &next, NULL);
  }
  phantom_haptic_device_close(phantom);
  return 0;
}

/* Joins a haptic device to Phantom: another process than Phantom's serves the device, and sends by this library what
 * the hand does and gets what the hand is to feel. docs/haptic_device.md says what a device must do and when.
 * Plain C (C99); SI units. Frame D is the device's base, right-handed; H is the handle, on whose origin forces act. */
#ifndef PHANTOM_HAPTIC_DEVICE_H
#define PHANTOM_HAPTIC_DEVICE_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Axes: position along x, y, z of D; orientation about them. */
#define PHANTOM_HAPTIC_POSITION 7u
#define PHANTOM_HAPTIC_ORIENTATION 56u

/* What the device is able to do. It is sent with every state. */
struct phantom_haptic_abilities {
  uint32_t measured_axes; /* POSITION, or POSITION | ORIENTATION */
  uint32_t actuated_axes; /* any of the six, bit by bit */
  double max_force_N;     /* that the motors exert all the time; 0 to 1000 */
  double max_moment_N_m;  /* 0 to 100 */
  double mass_kg;         /* least inertia that the hand finds along any axis; 0.001 to 100 */
  double inertia_kg_m2;   /* and about any axis; 1e-6 to 10 */
  double workspace_m;     /* half of the way along the shortest axis; 0.001 to 10 */
  double workspace_rad;   /* greatest rotation from the middle; 0 to 10 */
  double period_s;        /* at which states are sent; 0.00025 to 0.004 */
};

/* What the hand does with the device. */
struct phantom_haptic_state {
  double position_m[3];             /* of H in D; within 10 m */
  double orientation_xyzw[4];       /* unit quaternion of H in D; 0 0 0 1 if not measured */
  double velocity_m_s[3];           /* in D, of H's origin; within 10 m/s */
  double angular_velocity_rad_s[3]; /* in D; within 100 rad/s */
  int ready;                        /* the pose is true and the motors follow */
  int clutch;                       /* in: the hand wants to lead the tool */
  uint32_t buttons;
  double grip_opening; /* 0 to 1; -1: it has none */
};

/* What the device is to exert on the hand now, faded already if it is old. */
struct phantom_haptic_wrench {
  double force_N[3]; /* in D, at H's origin */
  double moment_N_m[3];
  int valid;       /* Phantom takes the device; 0: the wrench fades, or is 0 */
  int leads;       /* the hand leads the tool */
  double age_s;    /* since its receipt; -1: none yet */
  double answer_s; /* from the measurement that it answers to its receipt; -1: none of ours */
};

typedef struct phantom_haptic_device phantom_haptic_device;

/* Joins the domain of a topology: --deployment FILE, --domain N and --host NAME of `argv` are read as by Phantom's
 * processes, everything else is left to the caller. Returns NULL and writes why into `why` (ended by a 0) if it cannot.
 * Takes up to seconds: not for a real-time thread. */
phantom_haptic_device* phantom_haptic_device_open(int argc, char* const argv[],
                                                  const struct phantom_haptic_abilities* abilities, char* why,
                                                  size_t why_size);

/* Gives what the motors are to exert from now on. Call it once a period, before the next send: the state that is sent
 * then says that this wrench acted. Never blocks and allocates nothing. */
void phantom_haptic_device_receive(phantom_haptic_device* device, struct phantom_haptic_wrench* wrench);

/* Hands on a state that was measured just now. Returns 0; or 1 if a value is out of its range or none: nothing is sent
 * then, and Phantom lets go of a device that is not heard. Never blocks; allocates nothing unless it refuses. */
int phantom_haptic_device_send(phantom_haptic_device* device, const struct phantom_haptic_state* state);

/* Returns why the last send was refused; "" if none was. */
const char* phantom_haptic_device_why(const phantom_haptic_device* device);

/* Leaves the domain. NULL is allowed. All calls for one device belong to one thread. */
void phantom_haptic_device_close(phantom_haptic_device* device);

#ifdef __cplusplus
}
#endif

#endif

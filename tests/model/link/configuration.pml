/* What may happen, how long things last, and the names of numbers. */

/* Configuration: what may happen. Each is 0 or 1; where a side is named, 1: to the master, 2: to the slave, 3: to
 * both. */
#ifndef RESTARTS
#define RESTARTS 0 /* a process dies and another one starts in its place */
#endif
#ifndef DRIVES
#define DRIVES 0 /* drives lose power, do not follow, fail */
#endif
#ifndef STARVE
#define STARVE 0 /* the servo of a side is starved: it runs, but not often enough */
#endif
#ifndef SWITCH
#define SWITCH 0 /* each side has an enabling switch, which is held or not as its person likes */
#endif
#ifndef RIVAL
#define RIVAL 0 /* samples of a second writer come, to the side named */
#endif
#ifndef DELAY
#define DELAY 0 /* samples to the side named may be under way while both sides go on */
#endif
#ifndef TRIP
#define TRIP 0 /* with DELAY: how late is counted, and the round trip has its limit */
#endif
#ifndef REPEAT
#define REPEAT 0 /* with DELAY: samples come again */
#endif
#ifndef SETTLE
#define SETTLE 0 /* in every state: if the troubles ended now, would a person's resets lead to coupled in so many rounds? */
#endif
#ifndef ASKS
#define ASKS 3 /* at which side people ask for stops */
#endif
#ifndef RESETS
#define RESETS 1 /* people reset, whatever they name */
#endif
#ifndef POSES
#define POSES 1 /* poses may disagree at any time */
#endif
#ifndef TABLES
#define TABLES 0 /* print the law, row by row; for simulations */
#endif
#ifndef TRACE
#define TRACE 0 /* print each tick; for simulations */
#endif
#ifndef DEFECT
#define DEFECT 0
#endif

/* Durations in ticks of a side: n ticks are within the limit, n + 1 are not. */
#ifndef STALE
#define STALE 1
#endif
#ifndef ROUND_TRIP
#define ROUND_TRIP 2
#endif
#ifndef HOLD
#define HOLD 1
#endif
#ifndef RECOVERY
#define RECOVERY 1
#endif
#ifndef RAMP
#define RAMP 2
#endif
#define GUARD (STALE + 1) /* the source guard lets another process in after this many silent ticks */
#define CAP 1             /* torque: 0 none, 1 within the cap, 2 beyond it */

/* Link states, numbered as in the topics. */
#define INIT 0
#define READY 1
#define ALIGNED 2
#define COUPLED 3
#define DEGRADED 4
#define STOPPED 5

/* Whom a sample answers. */
#define NOBODY 0
#define US 1
#define ANOTHER 2

/* Who wrote a sample. */
#define PRESENT 0 /* the process that runs now */
#define FORMER 1  /* one that is gone */
#define SECOND 2  /* another one beside it */

/* Ids of stops, of each side its own: 0 none. An id that nothing refers to any more is used again, so that
 * the number of stops is not bounded. */
#define IDS 6
#define FOREIGN 7 /* id of a second writer's stop */
#define UNKNOWN 8 /* in a reset: an id that is in force nowhere any more */

#define OTHER(s) (1 - (s))
#define HEARD_NOT_STOPPED(s) (heard[s] && known[s].state != STOPPED)

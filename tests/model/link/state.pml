/* What there is: both sides, what each knows of the other, the wire, and what only the judges know. */

/* A sample as the other side needs it. */
typedef Sample {
  unsigned state : 3;
  unsigned stop : 4; /* 0: not stopped */
  unsigned answers : 2;
  unsigned writer : 2;
#if SWITCH
  unsigned permits : 1; /* its writer's enabling switch is held */
#endif
#if TRIP
  unsigned made : 3; /* ticks of its writer since it was made */
  unsigned trip : 3; /* ticks of its reader since the reader made what this answers */
#endif
}

/* The sides: 0 is the master, 1 the slave. */
byte state[2];
byte stop[2];     /* the latch: id of the stop in force; kept beyond the process */
byte released[2]; /* the partner's stop that a reset has named */
bit fault_before[2];
bit releasing[2];
byte agreed[2]; /* ticks for which poses have agreed and the partner was usable */
byte fresh[2];  /* ticks for which the partner was usable */
byte authority; /* of the master's torques; 0: no torque */

#if SWITCH
bit permit[2]; /* the side's enabling switch is held */
#endif

/* What a side knows of its partner. */
bit heard[2];
byte age[2]; /* own ticks since the newest accepted sample, at most GUARD */
Sample known[2];

/* The wire: one sample under way to each side, and one that may come again. Without DELAY: what the other side
 * says at the moment, or nothing. */
#if DELAY
bit under_way[2];
Sample wire[2];
#endif
#if REPEAT
bit repeats[2];
Sample again[2];
#endif

/* What a tick is given; no state between ticks. */
byte looked, asked, power, powered, fault, follows, starved, agree, has_reset, released_now, usable, in_time, partner_stopped;
byte reset_own, reset_partner, id, before, state_before, want, torque;

/* The judges know what happened; nothing above reads them. */
bit named_own[2];          /* a reset has named the stop in force */
byte named_partner[2];     /* bit i: a reset has named the partner's stop i */
byte in_truth[2];  /* ticks for which poses agreed with a partner that was heard in time */
#if TRIP
byte silent_stop[2]; /* own ticks since the partner stopped; 0: it is not stopped */
#endif
#if SWITCH
byte withheld[2]; /* own ticks since the partner's switch was let go; 0: it is held */
#endif
byte fading; /* ticks of the master since it was coupled */

#define LATE(s) ((DELAY >> (s)) & 1)
#define FOREIGN_TO(s) ((RIVAL >> (s)) & 1)

/* Whether stop i of the partner can still be heard of by side s. */
#if !DELAY
#define COMES_UP(s, i) (i == stop[OTHER(s)] || i == known[s].stop)
#define BITS_OF(s) ((1 << stop[OTHER(s)]) | (1 << known[s].stop))
#elif REPEAT
#define COMES_UP(s, i) (i == stop[OTHER(s)] || i == known[s].stop || i == wire[s].stop || i == again[s].stop)
#define BITS_OF(s) ((1 << stop[OTHER(s)]) | (1 << known[s].stop) | (1 << wire[s].stop) | (1 << again[s].stop))
#else
#define COMES_UP(s, i) (i == stop[OTHER(s)] || i == known[s].stop || i == wire[s].stop)
#define BITS_OF(s) ((1 << stop[OTHER(s)]) | (1 << known[s].stop) | (1 << wire[s].stop))
#endif
/* Whether stop i of side s is in force or can still be heard of. */
#define REFERRED_TO(s, i) (COMES_UP(OTHER(s), i) || i == released[OTHER(s)])

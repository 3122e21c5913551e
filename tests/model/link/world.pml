/* The world: processes that restart, what people, drives and poses do, and one tick of a side. */

/* What answers the process that is gone answers another one than the next; what it wrote is a former one's. */
inline answers_gone(sample) { sample.answers = (sample.answers == US -> ANOTHER : sample.answers) }
inline wrote_gone(sample, is) { sample.writer = (is && sample.writer == PRESENT -> FORMER : sample.writer) }

/* A new process in the place of side s: it knows nothing but the stop that was kept. */
inline restart(s) {
  before = stop[s];
#if DEFECT == 14 /* the stop dies with its process */
  stop[s] = 0;
#endif
  assert(stop[s] == before); /* SR-03: a stop outlives its process */
  before = 0;
  state[s] = (stop[s] != 0 -> STOPPED : INIT);
  released[s] = 0;
  fault_before[s] = 0;
  releasing[s] = 0;
  agreed[s] = 0;
  fresh[s] = 0;
  heard[s] = 0;
  age[s] = 0;
  clear(known[s]);
#if SWITCH
  permit[s] = 0;
  withheld[s] = 0;
#endif
  in_truth[s] = 0;
  named_own[s] = 0;
  named_partner[s] = 0;
  wrote_gone(known[OTHER(s)], heard[OTHER(s)]);
#if DELAY
  answers_gone(wire[s]);
  wrote_gone(wire[OTHER(s)], under_way[OTHER(s)]);
#endif
#if REPEAT
  answers_gone(again[s]);
  wrote_gone(again[OTHER(s)], repeats[OTHER(s)]);
#endif
#if TRIP
  silent_stop[s] = 0;
#endif
  if
  :: s == 0 -> authority = 0; fading = RAMP + 1
  :: else
  fi
}

inline nothing_chosen(s) {
  asked = 0;
  has_reset = 0;
  reset_own = 0;
  reset_partner = 0;
  fault = 0;
  follows = 1;
  starved = 0;
  agree = 1;
#if SWITCH
  permit[s] = 1;
#endif
  want = 2;
  powered = HEARD_NOT_STOPPED(s) && stop[s] == 0 /* as the last tick left it */
}

/* What people, drives and poses do in this tick. */
inline choose(s) {
#if TRACE
  select(luck : 0 .. 9);
#endif
  nothing_chosen(s);
#if DRIVES
  if
  :: RARE(6) -> fault = 1; follows = 0
  :: powered -> skip
  :: !powered || RARE(4) -> follows = 0
  fi;
#endif
#if STARVE
  if
  :: RARE(4) -> starved = 1
  :: skip
  fi;
#endif
#if SWITCH
  if
  :: RARE(4) -> permit[s] = 0
  :: skip
  fi;
#endif
  if
  :: POSES && RARE(3) && heard[s] -> agree = 0
  :: skip
  fi;
  if
  :: RARE(5) && ((ASKS >> (s)) & 1) -> asked = 1
  :: skip
  fi;
  if
  :: skip
  :: RESETS -> has_reset = 1; reset_own = UNKNOWN
  :: RESETS -> has_reset = 1; reset_own = stop[s];
     if
     :: skip
     :: released[s] != 0 -> reset_partner = UNKNOWN
     :: stop[OTHER(s)] != 0 -> reset_partner = stop[OTHER(s)]
     :: known[s].stop != 0 && known[s].stop != stop[OTHER(s)] -> reset_partner = known[s].stop
#if DELAY
     :: wire[s].stop != 0 && wire[s].stop != stop[OTHER(s)] && wire[s].stop != known[s].stop ->
        reset_partner = wire[s].stop
#endif
     fi
  fi
}

inline note_reset(s) {
  if
  :: has_reset && reset_own == stop[s] ->
     named_own[s] = 1;
     if
     :: reset_partner != 0 && reset_partner != UNKNOWN ->
        named_partner[s] = named_partner[s] | (1 << reset_partner)
     :: else
     fi
  :: else
  fi
}

/* What nothing can bring up any more is forgotten, so that equal situations are equal states. */
inline forget(s) {
  released[s] = (COMES_UP(s, released[s]) -> released[s] : 0);
  named_partner[s] = named_partner[s] & BITS_OF(s) & 254
}

inline work(s) {
  time_passes(s);
  note_reset(s);
  before = stop[s];
  looked = named_own[s] && !fault;
  step(s);
  judge(s)
}

inline tidy() {
  forget(0);
  forget(1);
  asked = 0; fault = 0; follows = 0; starved = 0; agree = 0; has_reset = 0; released_now = 0; usable = 0; in_time = 0;
  partner_stopped = 0; power = 0; powered = 0; looked = 0; reset_own = 0; reset_partner = 0; id = 0;
  before = 0; state_before = 0; want = 0; torque = 0
}

#if SWITCH
#define PERMIT(s) permit[s]
#define HEARD_PERMIT(s) known[s].permits
#else
#define PERMIT(s) 1
#define HEARD_PERMIT(s) 1
#endif
inline tell(s) {
#if TRACE
  printf("tick %d | %d %d %d %d %d | %d %d %d %d %d %d | %d %d %d %d %d | %d %d %d %d %d\n", s, asked, has_reset, reset_own,
         reset_partner, fault, heard[s], age[s], known[s].state, known[s].stop, known[s].answers, known[s].writer,
         agree, follows, starved, PERMIT(s), HEARD_PERMIT(s), state[s], stop[s], power, released_now, torque)
#else
  skip
#endif
}

inline tell_restart(s) {
#if TRACE
  printf("restart %d\n", s)
#else
  skip
#endif
}

inline tick(s) {
  atomic {
    choose(s);
    receive(s);
    d_step { work(s) }
    tell(s);
    send(s);
    d_step { tidy() }
  }
}

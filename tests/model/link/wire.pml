/* The wire: what sides say, what arrives, and what time does to it. */

inline copy(to, from) {
  to.state = from.state;
  to.stop = from.stop;
  to.answers = from.answers;
  to.writer = from.writer;
#if SWITCH
  to.permits = from.permits;
#endif
#if TRIP
  to.made = from.made;
  to.trip = from.trip;
#endif
}

inline clear(sample) {
  sample.state = 0;
  sample.stop = 0;
  sample.answers = 0;
  sample.writer = 0;
#if SWITCH
  sample.permits = 0;
#endif
#if TRIP
  sample.made = 0;
  sample.trip = 0;
#endif
}

/* Time passes for what side s has made and for what answers it. */
#if TRIP
inline older(sample_trip) { sample_trip = (sample_trip <= ROUND_TRIP -> sample_trip + 1 : sample_trip) }
inline time_passes(s) {
  older(wire[OTHER(s)].made);
  older(known[OTHER(s)].made);
  older(wire[s].trip);
  older(known[s].trip);
#if REPEAT
  older(again[OTHER(s)].made);
  older(again[s].trip);
#endif
}
#else
inline time_passes(s) { skip }
#endif

/* The source guard: in order from the process that is heard; from any after silence. */
#define OPEN(s) (!heard[s] || age[s] == GUARD)
#define LETS_IN(s, from) (OPEN(s) || known[s].writer == from)

/* What side s says of itself. */
inline say(s, sample) {
  sample.state = state[s];
  sample.stop = stop[s];
  sample.writer = PRESENT;
#if SWITCH
  sample.permits = permit[s];
#endif
  sample.answers = (heard[s] -> (known[s].writer == PRESENT -> US : ANOTHER) : NOBODY);
#if TRIP
  sample.made = 0;
  sample.trip = (heard[s] -> known[s].made : 0);
#endif
}

/* Whether a sample may come in this tick, and what comes. */
#if DELAY
#define ARRIVES(s) (LATE(s) -> under_way[s] && LETS_IN(s, wire[s].writer) : LETS_IN(s, PRESENT))
inline arrive(s) {
  if
  :: LATE(s) ->
     copy(known[s], wire[s]);
#if REPEAT
     copy(again[s], wire[s]);
     repeats[s] = 1;
#endif
     under_way[s] = 0;
     clear(wire[s])
  :: else -> say(OTHER(s), known[s])
  fi;
  heard[s] = 1;
  age[s] = 0
}
#else
#define ARRIVES(s) LETS_IN(s, PRESENT)
inline arrive(s) {
  say(OTHER(s), known[s]);
  heard[s] = 1;
  age[s] = 0
}
#endif

/* In simulations troubles are rare, so that the sides couple; searches try everything. */
#if TRACE
byte luck;
#define RARE(n) (luck >= n) /* with a probability of 2⁻ⁿ */
#else
#define RARE(n) true
#endif

inline grow_older(s) { age[s] = (heard[s] && age[s] < GUARD -> age[s] + 1 : age[s]) }

inline receive(s) {
  grow_older(s);
  if
  :: ARRIVES(s) -> d_step { arrive(s) }
  :: RARE(3) || !ARRIVES(s) -> skip /* lost, or on its way */
#if REPEAT
  :: repeats[s] && OPEN(s) -> d_step { copy(known[s], again[s]); heard[s] = 1; age[s] = 0 }
#endif
#if RIVAL
  :: RARE(3) && FOREIGN_TO(s) && LETS_IN(s, SECOND) ->
     clear(known[s]);
     known[s].writer = SECOND;
#if SWITCH
     known[s].permits = 1;
#endif
     heard[s] = 1;
     age[s] = 0;
     if
     :: known[s].state = READY
     :: known[s].state = COUPLED
     :: known[s].state = STOPPED; known[s].stop = FOREIGN
     fi;
     if
     :: known[s].answers = US
     :: known[s].answers = ANOTHER
     fi
#endif
  fi
}

inline put_on_wire(s) {
  say(s, wire[OTHER(s)]);
  under_way[OTHER(s)] = 1
}

inline send(s) {
#if DELAY
  if
  :: LATE(OTHER(s)) -> d_step { put_on_wire(s) }
  :: RARE(3) || !LATE(OTHER(s)) -> skip /* lost, or nothing is late there */
  fi
#else
  skip
#endif
}

/* A way out: from every state, if the troubles ended now. */

#if SETTLE
byte rounds, seen[2];
bit mended[2]; /* the drives' fault is gone: its cause is, and a reset was accepted */

inline calm_tick(s) {
  nothing_chosen(s);
  has_reset = rounds % 4 == 1; /* what the person saw a round ago */
  reset_own = (has_reset -> seen[s] : 0);
  reset_partner = (has_reset -> seen[OTHER(s)] : 0);
#if DRIVES
  fault = fault_before[s] && !mended[s];
  follows = powered && !fault;
#endif
  grow_older(s);
  if
  :: ARRIVES(s) -> arrive(s)
  :: else
  fi;
  work(s);
#if DRIVES
  mended[s] = released_now || !fault;
#endif
#if DELAY
  if
  :: LATE(OTHER(s)) -> put_on_wire(s)
  :: else
  fi;
#endif
  tidy()
}

/* From here on nobody stops anything, drives can be reset, nothing is lost, and a person looks every fourth
 * round at what is stopped and resets that. */
inline settle() {
  d_step {
    do
    :: rounds == SETTLE -> break
    :: else ->
       if
       :: rounds % 4 == 0 -> seen[0] = stop[0]; seen[1] = stop[1]
       :: else
       fi;
       calm_tick(0);
       calm_tick(1);
       rounds++
    od;
    assert(state[0] == COUPLED && state[1] == COUPLED)
  }
}
#endif

/* The law: what a side does in a tick. */

inline new_id(s) {
  id = 1;
  do /* `before` has just ended, but a reset that is on its way may name it */
  :: REFERRED_TO(s, id) || id == before -> id++
  :: else -> break
  od;
  assert(id <= IDS);
#if DEFECT == 4 /* a second stop keeps the first one's name */
  if
  :: stop[s] != 0 -> id = stop[s]
  :: else
  fi;
#endif
  stop[s] = id;
  releasing[s] = 0;
  named_own[s] = 0;
  named_partner[OTHER(s)] = named_partner[OTHER(s)] & ~(1 << id);
}

inline answer_reset(s) {
  released_now = 0;
  if
  /* 1: a reset releases whatever is in force. 15: a reset is refused while the partner is stopped. */
  :: has_reset && (reset_own == stop[s] || DEFECT == 1) && (DEFECT != 15 || !partner_stopped) ->
     if
     :: reset_partner != 0 -> released[s] = (reset_partner == UNKNOWN -> 0 : reset_partner)
     :: else
     fi;
     releasing[s] = 1;
     released_now = 1
  :: else
  fi;
}

/* The latch: stop_latch.cpp, StopLatch::step. */
inline latch(s) {
#if DEFECT != 3
  answer_reset(s);
#endif
  if
  :: asked -> new_id(s)
  :: else
  fi;
  if
  :: fault && !fault_before[s] -> new_id(s)
  :: else
  fi;
#if DEFECT == 3 /* a reset in the tick of a stop releases that stop */
  if
  :: has_reset && reset_own != 0 && reset_own == before -> reset_own = stop[s]
  :: else
  fi;
  answer_reset(s);
#endif
  fault_before[s] = fault;
  if
  :: releasing[s] && (!fault || DEFECT == 9) -> stop[s] = 0 /* 9: released with the drives in fault */
  :: else
  fi;
  if
  :: stop[s] == 0 -> releasing[s] = 0; named_own[s] = 0
  :: else
  fi;
#if DEFECT == 2 /* a stop lasts as long as its cause */
  if
  :: !asked && !fault && !partner_stopped -> stop[s] = 0
  :: else
  fi;
#endif
#if DEFECT != 5 /* 5: the partner's stop does not stop */
  if
  :: partner_stopped && !(known[s].stop != 0 && known[s].stop == released[s]) && stop[s] == 0 -> new_id(s)
  :: else
  fi;
#endif
}

/* The table: link_state.cpp, next_link_state. (An inline's arguments are put in as text.) */
inline transition(now, is_fresh, is_aligned, is_recovered, is_stop, partner) {
  if
  :: (is_stop) -> now = STOPPED
  :: else ->
     if
     :: now == INIT && (is_fresh) && partner != STOPPED -> now = READY
     :: now == READY && !((is_fresh) && partner != STOPPED) -> now = INIT
     :: now == READY && (is_fresh) && partner != STOPPED && (is_aligned) -> now = ALIGNED
     :: now == ALIGNED && !((is_fresh) && partner != STOPPED) -> now = INIT
     :: now == ALIGNED && (is_fresh) && partner != STOPPED && !(is_aligned) -> now = READY
     :: now == ALIGNED && (is_fresh) && partner != STOPPED && (is_aligned) &&
        (partner == ALIGNED || partner == COUPLED) -> now = COUPLED
#if DEFECT == 8 /* coupled as soon as the partner is */
     :: now == READY && (is_fresh) && partner == COUPLED && !(is_aligned) -> now = COUPLED
#endif
     :: now == COUPLED && !((is_fresh) && (partner == ALIGNED || partner == COUPLED)) -> now = DEGRADED
     :: now == DEGRADED && (is_recovered) && (is_fresh) && partner != STOPPED -> now = READY
     :: now == STOPPED -> now = INIT
     :: else
     fi
  fi
}

/* One tick of a side: link_state.cpp, LinkMonitor::step; master_io.cpp and slave_io.cpp for power and torque. */
inline step(s) {
  partner_stopped = heard[s] && known[s].state == STOPPED;
  latch(s);
#if DEFECT == 6 /* the partner never becomes stale */
  in_time = heard[s];
#else
  in_time = heard[s] && age[s] <= STALE;
#endif
#if DEFECT == 16 /* a starved loop stays coupled */
  usable = follows && in_time;
#else
  usable = follows && !starved && in_time;
#endif
#if DEFECT != 11 /* 11: also with a partner that answers another process */
  usable = usable && known[s].answers != ANOTHER;
#endif
#if SWITCH && DEFECT != 18 /* 18: the own switch is ignored */
  usable = usable && permit[s];
#endif
#if SWITCH && DEFECT != 19 /* 19: the partner's switch is ignored */
  usable = usable && known[s].permits;
#endif
#if TRIP && DEFECT != 7 /* 7: samples may be as late as they like */
  usable = usable && (known[s].answers != US || known[s].trip <= ROUND_TRIP);
#endif
  fresh[s] = (usable && !partner_stopped -> (fresh[s] <= RECOVERY -> fresh[s] + 1 : fresh[s]) : 0);
  agreed[s] = (usable && !partner_stopped && agree -> (agreed[s] <= HOLD -> agreed[s] + 1 : agreed[s]) : 0);
  state_before = state[s];
  transition(state[s], usable, agreed[s] > HOLD, fresh[s] > RECOVERY, stop[s] != 0, known[s].state);
  if
  :: state[s] == DEGRADED && state_before != DEGRADED -> fresh[s] = 0
  :: else
  fi;
#if DEFECT == 13 /* power also with a partner that is stopped */
  power = heard[s] && stop[s] == 0;
#elif DEFECT == 17 /* power also while the loop is starved */
  power = HEARD_NOT_STOPPED(s) && stop[s] == 0;
#else
  power = HEARD_NOT_STOPPED(s) && stop[s] == 0 && !starved;
#endif
  if
  :: s == 0 ->
     authority = (state[0] == COUPLED -> RAMP : (authority > 0 -> authority - 1 : 0));
#if DEFECT == 10 /* torques do not fade in a stop */
     authority = (state[0] == STOPPED && fading <= RAMP -> RAMP : authority);
#endif
     torque = (authority == 0 -> 0 : want);
#if DEFECT != 12 /* 12: torques have no cap */
     torque = (torque > CAP -> CAP : torque);
#endif
     power = power || torque > 0
  :: else
  fi
}

/* What must hold, after every tick. */

inline judge(s) {
  in_truth[s] = (heard[s] && age[s] <= STALE && agree && follows && known[s].state != STOPPED ->
                 (in_truth[s] <= HOLD -> in_truth[s] + 1 : in_truth[s]) : 0);
  /* SR-01, SR-05: a stop that is asked for is in force, under a name of its own, in the same tick. */
  assert(!asked || (stop[s] != 0 && stop[s] != before));
  assert(!fault || stop[s] != 0);
  /* SR-03: it ends only by a reset that names it, and never with the drives in fault. */
  assert(before == 0 || stop[s] != 0 || looked);
  assert((state[s] == STOPPED) == (stop[s] != 0));
  /* SR-02: the partner's stop is ours unless a reset has named it. */
  assert(!partner_stopped || stop[s] != 0 || (named_partner[s] & (1 << known[s].stop)));
  /* SR-04: no power, no motion of the arm in a stop; the hand's torque fades and stays away. */
  assert(stop[s] == 0 || !power || (s == 0 && torque > 0));
  assert(s == 1 || !power || HEARD_NOT_STOPPED(s) || torque > 0);
  assert(s == 0 || !power || HEARD_NOT_STOPPED(s));
  if
  :: s == 0 ->
     fading = (state[0] == COUPLED -> 0 : (fading <= RAMP -> fading + 1 : fading));
     assert(torque == 0 || fading < RAMP);
     assert(torque <= CAP) /* SR-08 */
  :: else
  fi;
  /* SR-06: nothing couples without alignment of both. */
  assert(state[s] != COUPLED || state_before == COUPLED ||
         (state_before == ALIGNED && in_truth[s] > HOLD &&
          (known[s].state == ALIGNED || known[s].state == COUPLED)));
  assert(state[s] != COUPLED || (!fault && follows && known[s].answers != ANOTHER));
  /* SR-07: who does not hear its partner in time is not coupled, in the same tick. */
  assert(state[s] != COUPLED || (heard[s] && age[s] <= STALE));
  /* SR-18: nor is who does not run often enough, and its drives hold by themselves once the hand's torque is gone. */
  assert(!starved || state[s] != COUPLED);
  assert(!starved || !power || (s == 0 && torque > 0));
#if SWITCH
  /* SR-19: nothing is coupled, nor the arm led to the master's pose, in a tick in which the own switch is not held or the partner
   * says that its own is not; nor is anything coupled longer than until the partner is stale after its switch was let go. */
  assert((permit[s] && known[s].permits) || (state[s] != READY && state[s] != ALIGNED && state[s] != COUPLED));
#if !DELAY && !RIVAL
  withheld[s] = (permit[OTHER(s)] -> 0 : (withheld[s] <= STALE + 1 -> withheld[s] + 1 : withheld[s]));
  assert(state[s] != COUPLED || withheld[s] <= STALE);
#endif
#endif
#if TRIP
  /* SR-07: whatever the wire does, a side is uncoupled a round trip after its partner stopped. */
  silent_stop[s] = (stop[OTHER(s)] == 0 -> 0 : (silent_stop[s] <= ROUND_TRIP + 1 -> silent_stop[s] + 1 : silent_stop[s]));
  assert(state[s] != COUPLED || silent_stop[s] <= ROUND_TRIP + 1);
#endif
}

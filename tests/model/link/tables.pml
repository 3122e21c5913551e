#if TABLES
/* Prints the two tables of the law: of transitions and of the latch. link_tables.csv has them. */
byte k, now, was_stop, was_released, was_fault, was_releasing, reset_is, partner_is, bits;

inline each_transition() {
  printf("transition,state,fresh,aligned,recovered,stop,partner,next\n");
  for (k : 0 .. 5) {
    for (partner_is : 0 .. 5) {
      for (bits : 0 .. 15) {
        now = k;
        transition(now, bits & 1, (bits >> 1) & 1, (bits >> 2) & 1, bits >> 3, partner_is);
        printf("transition,%d,%d,%d,%d,%d,%d,%d\n", k, bits & 1, (bits >> 1) & 1, (bits >> 2) & 1, bits >> 3, partner_is,
               now)
      }
    }
  }
}

/* stop: 0 none, 1 in force; next_stop: 1 means the same one, 2 a new one. released and the partner's stop: 0 none, 1
 * and 2 two ids. reset: 0 none, 1 and up name the stop in force, 4 and up do not, each with the partner's 0, 1, 2.
 * partner: 0 not stopped, 1 stopped without an id, 2 and 3 stopped with id 1 and 2. */
inline each_latch() {
  printf("latch,stop,released,fault_before,releasing,asked,fault,reset,partner,next_stop,next_released,next_releasing,accepted\n");
  for (k : 0 .. 23) {
    was_stop = k & 1;
    was_fault = (k >> 1) & 1;
    was_releasing = (k >> 2) & was_stop;
    was_released = k >> 3;
    for (bits : 0 .. 3) {
      for (reset_is : 0 .. 6) {
        for (partner_is : 0 .. 3) {
          stop[0] = was_stop; fault_before[0] = was_fault; releasing[0] = was_releasing; released[0] = was_released;
          asked = bits & 1;
          fault = bits >> 1;
          has_reset = reset_is > 0;
          reset_own = (reset_is > 3 -> UNKNOWN : was_stop);
          reset_partner = (reset_is > 0 -> (reset_is - 1) % 3 : 0);
          partner_stopped = partner_is > 0;
          known[0].stop = (partner_is > 1 -> partner_is - 1 : 0);
          before = was_stop;
          latch(0);
          if
          :: k % 8 == 4 || k % 8 == 6 -> skip /* the same as without `releasing` */
          :: else ->
             printf("latch,%d,%d,%d,%d,%d,%d,%d,%d,%d,%d,%d,%d\n", was_stop, was_released, was_fault, was_releasing, asked,
                    fault, reset_is, partner_is, (stop[0] == 0 -> 0 : (was_stop && stop[0] == was_stop -> 1 : 2)), released[0], releasing[0], released_now)
          fi
        }
      }
    }
  }
}
#endif

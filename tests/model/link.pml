/* The link between master and slave: two sides, a wire that loses, delays, repeats and splits, processes that
 * restart, drives that fail, a second writer, and people who stop and reset. README.md says how far this
 * abstracts, which configurations are searched and what each defect breaks.
 *
 * The parts `latch` and `transition` state the same law as common/teleop/coupling/stop_latch.cpp and link_state.cpp;
 * link_twin_test.cpp compares them with the C++ row by row, and drives the traces printed here through it. */

#include "link/configuration.pml"
#include "link/state.pml"
#include "link/law.pml"
#include "link/properties.pml"
#include "link/wire.pml"
#include "link/world.pml"
#include "link/way_out.pml"
#include "link/tables.pml"

#if TABLES
init {
  each_transition();
  each_latch()
}
#else
init {
  fading = RAMP + 1;
  do
  :: tick(0)
  :: tick(1)
#if RESTARTS
  :: RARE(7) -> atomic { tell_restart(0); d_step { restart(0) } }
  :: RARE(7) -> atomic { tell_restart(1); d_step { restart(1) } }
#endif
#if SETTLE
  :: settle() -> break
#endif
  od
}
#endif

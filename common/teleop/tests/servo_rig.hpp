#pragma once

#include "common/core/clock.hpp"
#include "common/teleop/coupling/link_state.hpp"
#include "common/teleop/tests/stop_store.hpp"

namespace phantom::teleop {

/// What the tests of both sides' servos share: a clock of the test's own, what comes in and is kept, and the
/// newest report. Runs repeat exactly.
template <class Inbox, class Report>
struct ServoRig {
  Inbox inbox;
  MemoryStopStore stops;
  core::Nanoseconds now_ns = 1'000'000'000;
  bool heard = true;  ///< whether the other side's samples arrive
  Report last;
  int published = 0;  ///< reports so far

  /// Makes a sample new and of now.
  template <class Sample>
  void renew(Sample& sample) const {
    sample.received_ns = now_ns;
    ++sample.stamp.sequence_number;
  }
  template <class Servo>
  void tick(Servo& servo, double period_s) {
    servo.tick(period_s, now_ns);
    published += servo.outbox.read(last) ? 1 : 0;
  }
  /// Calls `tick` until the servo has reported that state, for `most_s` of its periods at most.
  template <class Tick>
  bool reaches(LinkState wanted, double period_s, double most_s, Tick tick) {
    for (double t = 0; t < most_s && (published == 0 || state() != wanted); t += period_s) tick();
    return published > 0 && state() == wanted;
  }
  LinkState state() const { return last.outputs.state; }
};

}  // namespace phantom::teleop

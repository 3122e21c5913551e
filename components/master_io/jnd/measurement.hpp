#pragma once

#include <string>
#include <vector>

#include "common/core/status.hpp"
#include "common/messages/teleoperation.hpp"
#include "common/percept/staircase.hpp"
#include "components/master_io/jnd/felt_drag.hpp"

namespace phantom::master_io {

/// The master on which drags are compared. Its implementations speak to the running system or to a simulated
/// one.
class ComparedDrag {
 public:
  virtual ~ComparedDrag() = default;
  /// Sets G of the joint; returns once it is in force. Refusals carry the master's own reason.
  virtual core::Status set_gain(double gain) = 0;
  /// Waits for the next state of the master. Errors: it is silent; the measurement was interrupted.
  virtual core::Expected<messages::Received<messages::MasterState>> next() = 0;
};

/// Who compares.
class DragJudge {
 public:
  virtual ~DragJudge() = default;
  /// The interval of that number, 1 or 2, of the trial (from 1) begins: the hand has to move.
  virtual void begin(int trial, int interval) = 0;
  /// Returns whether the first drag was the greater one; an error ends the measurement. The arguments are
  /// what was felt, in N·m·s/rad or N·s/m: for simulated judges alone.
  virtual core::Expected<bool> calls_first_greater(double first, double second) = 0;
};

struct JndPlan {
  percept::StaircaseParameters staircase;
  FeltDragRules interval;
  std::string joint_name;        ///< for messages
  std::string unit;              ///< of its damping coefficient, likewise
  double reference_gain = 10.0;  ///< the lesser G of each comparison, above 0
  double patience_s = 60.0;      ///< an interval without enough motion ends the measurement after so long
  double most_limited = 0.02;    ///< share of an interval in which the drag may be limited, 0 to 1
  double most_deviation = 0.3;   ///< by which the felt ratio of two drags may differ from that of their G
};

struct JndTrial {
  percept::Comparison comparison;
  double first = 0.0, second = 0.0;  ///< felt, N·m·s/rad or N·s/m
  bool first_called_greater = false;
};

struct JndOutcome {
  percept::JustNoticeable threshold;
  bool settled = false;    ///< Staircase::settled()
  double reference = 0.0;  ///< mean of the lesser drags, N·m·s/rad or N·s/m
  std::vector<JndTrial> trials;
};

/// Measures the just noticeable difference of drag on one joint: in each trial the hand moves in two drags,
/// G and G·(1 + fraction) in random order, and the judge tells the greater one. The threshold rests on the
/// drags as they were felt. G is the reference again after each trial and at every end. Errors: the drag was
/// limited by the device's stability or a cap, or its ratio was another than that of G, so that it was not
/// what was asked for; there was no drag, or no motion; what `drag` and `judge` report.
core::Expected<JndOutcome> measure_jnd(const JndPlan& plan, ComparedDrag& drag, DragJudge& judge);

}  // namespace phantom::master_io

#pragma once

#include <array>
#include <deque>
#include <string>

#include "components/synthetic_viewer/drawing.hpp"
#include "components/synthetic_viewer/report.hpp"

namespace phantom::synthetic_viewer {

/// Takes the fine pictures of a session's report: every alert's zone as it was, and the main view at the
/// session's milestones. They must not hold up the live ones. Of the drawing's thread.
class ReportPictures {
 public:
  /// `begin_ns` (CLOCK_MONOTONIC): from when the report counts.
  ReportPictures(Report& report, core::Nanoseconds begin_ns) : report_(report), begin_ns_(begin_ns) {}

  /// A raised alert.
  void take(const HitSample& alert);
  /// In a round: one alert's picture at the most, and that of each milestone that is reached for the first
  /// time: all there (`complete`), a hit threatens, a contact. False if `give_up` said yes on the way; what
  /// is missing is taken in a later round.
  bool photograph(Drawing& drawing, const ArmSample& arm, bool complete, const GiveUp& give_up);
  /// At the session's end: what alerts have kept from being drawn, as far as that takes not too long, and the
  /// main view as it is.
  void finish(Drawing& drawing);

 private:
  bool photograph_alert(Drawing& drawing, const GiveUp& give_up);

  struct Milestone {
    const char* name;
    bool saved = false;
  };
  Report& report_;
  core::Nanoseconds begin_ns_;
  std::deque<HitSample> alerts_;
  std::array<Milestone, 3> milestones_{{{"main_start"}, {"main_first_hit"}, {"main_first_contact"}}};
};

}  // namespace phantom::synthetic_viewer

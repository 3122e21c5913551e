#pragma once

#include <array>
#include <deque>
#include <string>

#include "components/synthetic_viewer/drawing.hpp"
#include "components/synthetic_viewer/report.hpp"

namespace phantom::synthetic_viewer {

/// Makes the higher-quality pictures of a session's report: every alert's zone as it was, and the main view
/// at the session's milestones. They must not delay the live pictures. Use it on the drawing's thread.
class ReportPictures {
 public:
  /// `begin_ns` (CLOCK_MONOTONIC): zero of the report's times.
  ReportPictures(Report& report, core::Nanoseconds begin_ns) : report_(report), begin_ns_(begin_ns) {}

  /// Queues a raised alert.
  void take(const HitSample& alert);
  /// Makes this round's pictures: at most one alert's, and one for each milestone reached for the first time:
  /// everything is there (`complete`), a hit threatens, a contact. Returns false if `give_up` returned true
  /// meanwhile; the missing pictures follow in a later round.
  bool photograph(Drawing& drawing, const ArmSample& arm, bool complete, const GiveUp& give_up);
  /// Makes the remaining pictures at the session's end: those of alerts, as far as time allows, and the main
  /// view as it is.
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

#pragma once

#include <array>
#include <deque>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "components/synthetic_viewer/scene/drawing.hpp"

namespace phantom::synthetic_viewer {

/// Makes a session's report folder: synthetic_viewer.json and pictures of higher quality, of every alert's
/// zone as it was and of the main view at the session's milestones. They must not delay the live pictures:
/// each is encoded and written on a separate thread. Does nothing without a folder. Use it on the drawing's
/// thread.
class Report {
 public:
  /// Creates the folder. `begin_ns` (CLOCK_MONOTONIC): zero of the report's times. Throws core::MissingError
  /// if there can be no such folder.
  Report(std::filesystem::path folder, int most_hit_pictures, core::Nanoseconds begin_ns);
  ~Report();

  bool wants_hit_pictures() const { return wanted() && views_.size() < most_hit_pictures_; }
  /// Queues a raised alert.
  void take(const HitSample& alert);
  /// Makes this round's pictures: at most one alert's, and one for each milestone reached for the first time:
  /// everything is there (`complete`), a hit threatens, a contact. Returns false if `give_up` returned true
  /// meanwhile; the missing pictures follow in a later round.
  bool make_pictures(Drawing& drawing, const ArmSample& arm, bool complete, const CancelCheck& give_up);
  /// Makes the remaining pictures at the session's end: those of alerts, as far as time allows, and the main
  /// view as it is.
  void make_remaining_pictures(Drawing& drawing);
  /// Waits until all pictures are written, then writes synthetic_viewer.json: `summary` and the pictures.
  void finish(nlohmann::json summary);

 private:
  bool wanted() const { return !folder_.empty(); }
  bool make_alert_picture(Drawing& drawing, const CancelCheck& give_up);
  bool make_main_picture(Drawing& drawing, const char* name, const CancelCheck& give_up);

  struct Milestone {
    const char* name;
    bool saved = false;
  };
  class Writer;

  std::filesystem::path folder_;
  std::unique_ptr<Writer> writer_;
  std::size_t most_hit_pictures_;
  core::Nanoseconds begin_ns_;
  std::deque<HitSample> alerts_;
  std::array<Milestone, 3> milestones_{{{"main_start"}, {"main_first_hit"}, {"main_first_contact"}}};
  nlohmann::json views_ = nlohmann::json::array(), pictures_ = nlohmann::json::array();
};

}  // namespace phantom::synthetic_viewer

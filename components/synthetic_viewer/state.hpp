#pragma once

#include <deque>
#include <map>
#include <string>

#include "components/synthetic_viewer/camera_control.hpp"
#include "components/synthetic_viewer/samples.hpp"
#include "components/synthetic_viewer/stop_board.hpp"
#include "components/synthetic_viewer/view_choice.hpp"

namespace phantom::synthetic_viewer {

/// Ages beyond which what was received no longer tells what is.
struct Staleness {
  double slave_s = 0.25;
  double percept_s = 0.5;
  double component_s = 2.0;  ///< status comes at 2 Hz
};

/// An alert as the page lists it.
struct HitRecord {
  HitSample raised;
  double cleared_after_s = -1.0;  ///< −1: still threatens
};

/// How much of slave_state comes through, by its numbers, over the last second or so.
class LinkQuality {
 public:
  void take(const ArmSample& arm, core::Nanoseconds now_ns) noexcept;
  /// 0…1; negative: not known yet.
  double share() const noexcept { return share_; }

 private:
  core::Nanoseconds since_ns_ = 0;
  std::uint64_t arrived_ = 0, lost_ = 0;
  double share_ = -1.0;
};

/// A recording, as it is told.
struct RecordingState {
  bool running = false;
  View view = View::kMain;
  std::string file;     ///< of the running one, or of the last
  std::string problem;  ///< why the last one could not begin or ended; empty: nothing went wrong
  int frames = 0;       ///< written so far into that file
};

/// What is on now, for those who toggle it.
struct ViewSwitches {
  bool hold = false, recording = false;
};

/// Everything the viewer knows at one moment. A plain value of its thread; pure.
struct ViewerState {
  ArmSample arm;
  PerceptSample percept;
  MasterSample master;
  SkinSample skin;
  WorkspaceSample workspace;
  LinkQuality link_quality;
  std::map<std::uint16_t, ObjectSample> objects;
  std::deque<HitRecord> hits;                         ///< newest last, at most kMaxHits
  std::map<std::string, ComponentSample> components;  ///< by name, and host where two have the same
  ViewNode chosen = ViewNode::kAutomatic;
  bool hold = false;
  CameraControl cameras;
  RecordingState recording;
  StopView stops;
  std::uint64_t total_hits = 0;
  core::Nanoseconds first_object_ns = 0;  ///< when the first object came; 0: none yet
  std::string graphics;                   ///< what draws, as the driver calls it

  static constexpr std::size_t kMaxHits = 40;

  void take(const HitSample& hit);
  void take(ComponentSample component);
  /// View commands; others are not the viewer's.
  void take(const Command& command);
};

/// Seconds since `received_ns`; infinite if nothing was received.
double age_s(core::Nanoseconds received_ns, core::Nanoseconds now_ns) noexcept;

/// What a picture must say in large letters, in one or two lines; empty if all is well: a stop and who has
/// not confirmed it, else two processes in one's place, else condition_text().
std::string banner_text(const ViewerState& state, const Staleness& staleness, core::Nanoseconds now_ns);

/// In order of urgency: lost or missing slave, degraded link, phantom silent or without a valid model.
std::string condition_text(const ViewerState& state, const Staleness& staleness, core::Nanoseconds now_ns);

/// "table" or "object 7" if the name is not known; "free space" for 0.
std::string object_name(const ViewerState& state, std::uint16_t id);

std::string label_of(LinkState state);  ///< "COUPLED"
const char* name_of(MotionClass motion) noexcept;
const char* name_of(HitRule rule) noexcept;
const char* name_of(core::ComponentState state) noexcept;

}  // namespace phantom::synthetic_viewer

#pragma once

#include <deque>
#include <map>
#include <string>

#include "components/synthetic_viewer/samples.hpp"
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

/// Everything the viewer knows at one moment. A plain value of its thread; pure.
struct ViewerState {
  ArmSample arm;
  PerceptSample percept;
  MasterSample master;
  std::map<std::uint16_t, ObjectSample> objects;
  std::deque<HitRecord> hits;                         ///< newest last, at most kMaxHits
  std::map<std::string, ComponentSample> components;  ///< by name, and host where two have the same
  ViewNode wish = ViewNode::kAutomatic;
  bool hold = false;
  std::uint64_t total_hits = 0;

  static constexpr std::size_t kMaxHits = 40;

  void take(const HitSample& hit);
  void take(ComponentSample component);
  /// View commands; others are not the viewer's.
  void take(const Command& command);
};

/// Seconds since `received_ns`; infinite if nothing was received.
double age_s(core::Nanoseconds received_ns, core::Nanoseconds now_ns) noexcept;

/// What must be said in large letters; empty if all is well. In order of urgency: emergency stop, lost or
/// missing slave, degraded link, phantom silent or without a valid model.
std::string banner_text(const ViewerState& state, const Staleness& staleness, core::Nanoseconds now_ns);

/// "table" or "object 7" if the name is not known; "free space" for 0.
std::string object_name(const ViewerState& state, std::uint16_t id);

const char* name_of(LinkState state) noexcept;
const char* name_of(MotionClass motion) noexcept;
const char* name_of(HitRule rule) noexcept;
const char* name_of(core::ComponentState state) noexcept;

}  // namespace phantom::synthetic_viewer

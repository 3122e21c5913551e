#include "components/synthetic_viewer/compositor.hpp"

#include <cmath>
#include <cstdio>

namespace phantom::synthetic_viewer {
namespace {

constexpr Colour kLookAtColour{0.95F, 0.75F, 0.05F}, kContactColour{0.95F, 0.03F, 0.03F};
constexpr double kGapUnknown_m = 0.10, kGapReach_m = 0.30;

Eigen::Vector3d eigen(const Vector3& v) { return {v[0], v[1], v[2]}; }

std::string age_text(double age_s) {
  char text[32];
  if (!std::isfinite(age_s)) return "-";
  std::snprintf(text, sizeof text, age_s < 1 ? "%.0f ms" : "%.1f s", age_s < 1 ? age_s * 1e3 : age_s);
  return text;
}

}  // namespace

bool Compositor::percept_known(const Moment& moment) const {
  return moment.state.percept.valid &&
         age_s(moment.state.percept.received_ns, moment.now_ns) <= config_.staleness.percept_s;
}

double Compositor::gap_m(const RayScene& objects, const Eigen::Vector3d& from_m,
                         const Eigen::Vector3d& pgv) const {
  if (pgv.isZero()) return kGapUnknown_m;
  return objects.nearest(from_m, pgv.normalized(), 0.0, kGapReach_m).value_or(kGapUnknown_m);
}

Aids Compositor::live_aids(const Moment& moment) const {
  const PerceptSample& percept = moment.state.percept;
  Aids aids;
  aids.position_m = eigen(percept.position_m);
  aids.pgv = eigen(percept.pgv);
  aids.velocity_m_s = eigen(percept.velocity_m_s);
  aids.motion = percept.motion;
  aids.closeness = percept.closeness;
  aids.gap_m = gap_m(moment.objects, aids.position_m, aids.pgv);
  return aids;
}

Aids Compositor::hit_aids(const Moment& moment, const HitView& hit) const {
  // As long as the worst sensor is in the zone that is shown, the aids follow it; else they mark what was
  // latched.
  constexpr double kZone_m = 0.25;
  const PerceptSample& percept = moment.state.percept;
  const double away_m = (eigen(percept.position_m) - hit.situation.look_at_m).norm();
  if (percept_known(moment) && percept.closeness > 0 && away_m <= kZone_m) {
    Aids aids = live_aids(moment);
    if (!aids.pgv.isZero()) return aids;
  }
  Aids aids;
  aids.position_m = hit.situation.look_at_m;
  aids.pgv = hit.situation.pgv;
  aids.closeness = hit.threatening ? 1.0 : 0.0;
  aids.gap_m = gap_m(moment.objects, aids.position_m, aids.pgv);
  return aids;
}

void Compositor::add_contact(Frame& frame, const Moment& moment) const {
  const ArmSample& arm = moment.state.arm;
  if (arm.contact && age_s(arm.received_ns, moment.now_ns) <= config_.staleness.slave_s) {
    add_marker(frame, eigen(arm.contact_point_m), 0.014, kContactColour);
  }
}

Frame Compositor::main_frame(const Moment& moment, const HitView& hit) const {
  const MainViewConfig& view = config_.main_view;
  Frame frame = scene_.frame(moment.state, config_.staleness, moment.now_ns);
  const double aspect = static_cast<double>(view.format.width_px) / view.format.height_px;
  // The strip of gauges covers the picture's lower edge: the box to be shown begins a little below the floor.
  Eigen::Vector3d low_m = scene_.min_m();
  low_m.z() -= 0.14 * (scene_.max_m().z() - low_m.z());
  frame.camera = frame_box(low_m, scene_.max_m(), view.azimuth_rad, view.elevation_rad,
                           view.field_of_view_rad, aspect, view.margin);
  if (percept_known(moment) && moment.state.percept.closeness > 0) add_arrows(frame, live_aids(moment));
  if (hit.alert != 0) add_marker(frame, hit.situation.look_at_m, 0.016, kLookAtColour);
  add_contact(frame, moment);
  return frame;
}

Frame Compositor::hit_frame(const Moment& moment, const HitView& hit) const {
  Frame frame = scene_.frame(moment.state, config_.staleness, moment.now_ns);
  frame.camera.eye_m = hit.eye_m;
  frame.camera.target_m = hit.situation.look_at_m;
  frame.camera.vertical_fov_rad = config_.hit_view.field_of_view_rad;
  const Aids aids = hit_aids(moment, hit);
  add_arrows(frame, aids);
  add_cone_and_plane(frame, aids);
  add_marker(frame, hit.situation.look_at_m, 0.006, kLookAtColour);
  add_contact(frame, moment);
  return frame;
}

Frame Compositor::tool_frame(const Moment& moment) const {
  Frame frame = scene_.frame(moment.state, config_.staleness, moment.now_ns);
  robot::LinkPoses X_WL;
  scene_.arm().link_poses(moment.state.arm.position, X_WL);
  const geometry::Pose& X_WT = X_WL[scene_.arm().joint_count()];
  frame.camera.eye_m = X_WT * config_.tool_view.eye_m;
  frame.camera.target_m = X_WT * config_.tool_view.look_at_m;
  frame.camera.vertical_fov_rad = config_.tool_view.field_of_view_rad;
  add_contact(frame, moment);
  return frame;
}

Hud Compositor::main_hud(const Moment& moment) const {
  const ViewerState& state = moment.state;
  const PerceptSample& percept = state.percept;
  Hud hud;
  hud.title = cell_;
  hud.banner = banner_text(state, config_.staleness, moment.now_ns);
  hud.gauges = true;
  hud.closeness_known = percept_known(moment);
  hud.closeness = percept.closeness;
  hud.speed_m_s = percept.speed_m_s;
  hud.motion = hud.closeness_known ? name_of(percept.motion) : "-";
  const bool near = hud.closeness_known && percept.closeness > 0;
  hud.nearest = near ? scene_.link_name(percept.link) + " - " + object_name(state, percept.object) : "-";
  hud.link_state = state.arm.received_ns == 0 ? "-" : name_of(state.arm.state);
  hud.model_age = age_text(age_s(state.arm.received_ns, moment.now_ns));
  if (state.arm.contact && hud.banner.empty()) {
    hud.subtitle = "contact with " + object_name(state, state.arm.contact_object);
  }
  return hud;
}

Hud Compositor::hit_hud(const Moment& moment, const HitView& hit) const {
  const ViewerState& state = moment.state;
  Hud hud;
  hud.title = "HIT ZONE - from " + std::string(node_name(hit.node)) + (state.hold ? " - held" : "");
  hud.alarm = hit.threatening;
  for (const HitRecord& record : state.hits) {
    if (record.raised.alert != hit.alert) continue;
    const std::string link =
        record.raised.link_name.empty() ? scene_.link_name(record.raised.link) : record.raised.link_name;
    hud.subtitle = "alert " + std::to_string(hit.alert) + ": " + link + " - " +
                   object_name(state, record.raised.object) + (hit.threatening ? "" : " (over)");
  }
  hud.banner = banner_text(state, config_.staleness, moment.now_ns);
  return hud;
}

Hud Compositor::tool_hud(const Moment& moment) const {
  Hud hud;
  hud.title = "END EFFECTOR";
  hud.banner = banner_text(moment.state, config_.staleness, moment.now_ns);
  return hud;
}

}  // namespace phantom::synthetic_viewer

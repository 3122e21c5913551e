#include "components/synthetic_viewer/scene/compositor.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "components/synthetic_viewer/state/view_direction.hpp"

namespace phantom::synthetic_viewer {
namespace {

constexpr Colour kLookAtColour{0.95F, 0.75F, 0.05F}, kContactColour{0.95F, 0.03F, 0.03F};
constexpr double kGapUnknown_m = 0.10, kGapReach_m = 0.30;
constexpr double kHitZone_m = 0.02;  // radius of the region that a view of a hit zone should show

std::string age_text(double age_s) {
  if (!std::isfinite(age_s)) return "-";
  if (age_s < 0.01) return "< 10 ms";  // an exact number would change with every picture and say no more
  return age_s < 1 ? fmt::format("{:.0f} ms", std::floor(age_s * 100) * 10) : fmt::format("{:.1f} s", age_s);
}

/// Returns "99.8 % 1.2 ms": the share of slave_state that arrives, and the haptic round trip.
std::string link_text(const ViewerState& state) {
  const double quality = state.link_quality.share();
  // Rounded down, so that 100 % means that nothing was lost.
  const std::string share = quality < 0 ? "-" : fmt::format("{:.1f} %", std::floor(1000 * quality) / 10);
  if (state.master.received_ns == 0 || state.master.round_trip_s < 0) return share;
  return share + fmt::format(" {:.1f} ms", 1e3 * state.master.round_trip_s);
}

/// Returns half a voxel's diagonal as text: a surface passes anywhere through its boundary voxels, whose
/// centres represent it.
std::string voxel_error_text(const WorkspaceSample& workspace) {
  return workspace.version == 0 ? "-" : fmt::format("{:.1f} mm", 1e3 * workspace.voxel_error_m);
}

/// Returns how old the video is, and what is drawn over it.
std::string video_text(const VideoMoment& video, bool arm_known, Language language) {
  const double age_ms = std::floor(video.age_s * 100) * 10;
  std::string text = in(language, video.latency_known ? LocalizedText{"video.age", {{"age_ms", age_ms}}}
                                                      : LocalizedText{"video.age_unknown", {}});
  if (!arm_known) text += " - " + in(language, {"video.arm_unknown", {}});
  return text + (video.calibration.empty() ? "" : " - " + in(language, video.calibration));
}

}  // namespace

HitViewConfig at_scale(HitViewConfig config, double scale) {
  config.choice.distance_m *= scale;
  return config;
}

VisibleShare visible_among(const RayScene& bodies, double scale) {
  return [&bodies, scale](const ViewSituation& situation, const Eigen::Vector3d& eye_m) {
    Camera camera = at_scale(Camera(), scale);
    camera.eye_m = eye_m;
    camera.target_m = situation.look_at_m;
    return bodies.visible_share(situation.look_at_m, situation.pgv, scale * kHitZone_m,
                                unobstructed(camera, bodies).camera.eye_m);
  };
}

bool Compositor::percept_known(const Moment& moment) const {
  return moment.state.percept.valid &&
         age_s(moment.state.percept.received_ns, moment.now_ns) <= config_.staleness.percept_s;
}

/// Returns how far it is along the PGV to a surface, or to the zone if it is that which is near.
double Compositor::gap_m(const RayScene& objects, const Eigen::Vector3d& from_m, const Eigen::Vector3d& pgv,
                         std::uint16_t object) const {
  const double unknown_m = scene_.scale() * kGapUnknown_m, reach_m = scene_.scale() * kGapReach_m;
  if (pgv.isZero()) return unknown_m;
  if (scene_.zones.contains(object))
    return objects.to_zone(object, from_m, pgv.normalized(), reach_m).value_or(unknown_m);
  return objects.nearest(from_m, pgv.normalized(), 0.0, reach_m).value_or(unknown_m);
}

/// Sets how large aids are beside an object; their gap must be set.
void Compositor::set_size(Aids& aids, double thickness_m) const {
  aids.size = scene_.scale();
  aids.scale = aids.size * aids_scale(thickness_m, aids.gap_m, aids.size);
}

Aids Compositor::live_aids(const Moment& moment) const {
  const PerceptSample& percept = moment.state.percept;
  Aids aids;
  aids.position_m = eigen(percept.position_m);
  aids.pgv = eigen(percept.pgv);
  aids.pgs_Pa_s_per_m = percept.pgs;
  aids.velocity_m_s = eigen(percept.velocity_m_s);
  aids.motion = percept.motion;
  aids.closeness = percept.closeness;
  aids.gap_m = gap_m(moment.objects, aids.position_m, aids.pgv, percept.object);
  set_size(aids, scene_.thickness_m(moment.state, percept.object));
  return aids;
}

/// Returns the aids of a threat that the percept has now.
Aids Compositor::threat_aids(const Moment& moment, const messages::Threat& threat) const {
  Aids aids;
  aids.position_m = eigen(threat.position_m);
  aids.pgv = eigen(threat.pgv);
  aids.pgs_Pa_s_per_m = threat.pgs;
  aids.velocity_m_s = eigen(threat.velocity_m_s);
  aids.motion = threat.motion;
  aids.closeness = threat.closeness;
  aids.gap_m = gap_m(moment.objects, aids.position_m, aids.pgv, threat.object);
  set_size(aids, scene_.thickness_m(moment.state, threat.object));
  return aids;
}

Aids Compositor::hit_aids(const Moment& moment, const HitView& hit) const {
  if (hit.approach) {
    Aids aids;
    aids.position_m = hit.approach->tool_m;
    aids.pgv = hit.situation.pgv;
    aids.gap_m = hit.approach->gap_m;
    aids.scale = aids.size = scene_.scale();
    return aids;
  }
  // The aids follow the threat that is shown, or the place that leads the percept while it is in the zone;
  // otherwise they mark what was shown last.
  const double zone_m = 0.25 * scene_.scale();
  const PerceptSample& percept = moment.state.percept;
  const auto threat = std::ranges::find_if(percept.threats, [&hit](const messages::Threat& one) {
    return one.link == hit.link && one.object == hit.object;
  });
  if (percept_known(moment) && hit.threatening && threat != percept.threats.end()) {
    Aids aids = threat_aids(moment, *threat);
    if (!aids.pgv.isZero()) return aids;
  }
  const double away_m = (eigen(percept.position_m) - hit.situation.look_at_m).norm();
  if (percept_known(moment) && percept.closeness > 0 && away_m <= zone_m) {
    Aids aids = live_aids(moment);
    if (!aids.pgv.isZero()) return aids;
  }
  Aids aids;
  aids.position_m = hit.situation.look_at_m;
  aids.pgv = hit.situation.pgv;
  aids.closeness = hit.threatening ? 1.0 : 0.0;
  aids.gap_m = gap_m(moment.objects, aids.position_m, aids.pgv, hit.object);
  set_size(aids, scene_.thickness_m(moment.state, hit.object));
  return aids;
}

void Compositor::add_contact(Frame& frame, const Moment& moment) const {
  const ArmSample& arm = moment.state.arm;
  const bool seen = arm.contact && arm.contact_force_N >= 0.0;  // otherwise nobody knows where it is
  if (seen && age_s(arm.received_ns, moment.now_ns) <= config_.staleness.slave_s) {
    add_marker(frame, eigen(arm.contact_point_m), 0.014 * scene_.scale(), kContactColour);
  }
}

/// Returns what was in a camera's way, in words; empty: nothing.
LocalizedText Compositor::note_of(const ViewerState& state, const UnobstructedCamera& place) const {
  if (!place.blocked_by) return {};
  return {"view_note.in_the_way",
          {{"body", scene_.body_name(state, *place.blocked_by)},
           {"wanted_m", place.wanted_m},
           {"distance_m", place.distance_m}}};
}

/// Returns the scene seen from the operator's camera position, or from the nearest free one.
Frame Compositor::frame_from(const Moment& moment, View view, const Camera& camera, Hud& hud) const {
  Frame frame = scene_.frame(moment.state, config_.staleness, moment.now_ns);
  // The camera on the arm is meant to be close to it, so the arm does not block it.
  const RayScene& bodies = view == View::kTool ? moment.objects : moment.bodies;
  const UnobstructedCamera place = unobstructed(moment.state.cameras.moved(camera, view), bodies);
  frame.camera = place.camera;
  const std::string note = said(note_of(moment.state, place));
  if (!note.empty()) hud.subtitle += (hud.subtitle.empty() ? "" : " - ") + note;
  const RecordingState& recording = moment.state.recording;
  hud.recording = recording.running && recording.view == view;
  return frame;
}

/// Returns the default camera of the main view.
Camera Compositor::main_home() const {
  const MainViewConfig& view = config_.main_view;
  const double aspect = static_cast<double>(view.format.width_px) / view.format.height_px;
  // The strip of gauges covers the picture's lower edge, so the box to be shown starts a little below the
  // floor.
  Eigen::Vector3d low_m = scene_.min_m();
  low_m.z() -= 0.14 * (scene_.max_m().z() - low_m.z());
  Camera camera = frame_box(low_m, scene_.max_m(), view.azimuth_rad, view.elevation_rad,
                            view.field_of_view_rad, aspect, view.margin);
  camera.clearance_m *= scene_.scale();
  return camera;
}

/// Returns the default camera of the hit zone's view.
Camera Compositor::hit_home(const HitView& hit) const {
  Camera camera = at_scale(Camera(), scene_.scale());
  camera.eye_m = hit.eye_m;
  camera.target_m = hit.situation.look_at_m;
  camera.vertical_fov_rad = config_.hit_view.field_of_view_rad;
  return camera;
}

Camera Compositor::main_camera(const Moment& moment) const {
  return unobstructed(moment.state.cameras.moved(main_home(), View::kMain), moment.bodies).camera;
}

Camera Compositor::hit_camera(const Moment& moment, const HitView& hit) const {
  return unobstructed(moment.state.cameras.moved(hit_home(hit), View::kHit), moment.bodies).camera;
}

/// Returns the camera on the arm's last link.
Camera Compositor::tool_home(const ViewerState& state) const {
  robot::LinkPoses X_WL;
  scene_.arm().link_poses(state.arm.position, X_WL);
  const geometry::Pose& X_WT = X_WL[scene_.arm().joint_count()];
  Camera camera = at_scale(Camera(), scene_.scale());
  camera.eye_m = X_WT * (scene_.scale() * config_.tool_view.eye_m);
  camera.target_m = X_WT * (scene_.scale() * config_.tool_view.look_at_m);
  camera.vertical_fov_rad = config_.tool_view.field_of_view_rad;
  return camera;
}

double Compositor::tool_free_share(const Moment& moment) const {
  const UnobstructedCamera place = unobstructed(tool_home(moment.state), moment.objects);
  return std::min(1.0, place.distance_m / place.wanted_m);
}

Compositor::Homes Compositor::homes(const Moment& moment, const HitView& hit) const {
  Homes homes;
  homes.main = unobstructed(main_home(), moment.bodies);
  homes.main_note = note_of(moment.state, homes.main);
  homes.free_m.fill(scene_.scale() * config_.hit_view.rule.choice.distance_m);
  if (hit.alert == 0) return homes;
  homes.hit = unobstructed(hit_home(hit), moment.bodies);
  homes.title = hit_title(moment.state, hit);
  if (LocalizedText note = note_of(moment.state, homes.hit); !note.empty())
    homes.title.push_back(std::move(note));
  for (int number = 1; number <= percept::kNodeCount; ++number) {
    HitView from = hit;
    double& free_m = homes.free_m[static_cast<std::size_t>(number - 1)];
    from.eye_m =
        hit.situation.look_at_m + free_m * percept::node_direction(static_cast<percept::ViewNode>(number));
    free_m = unobstructed(hit_home(from), moment.bodies).distance_m;
  }
  return homes;
}

void Compositor::add_aids(Frame& frame, View view, const Moment& moment, const HitView& hit) const {
  if (view == View::kHit) {
    const Aids aids = hit_aids(moment, hit);
    add_arrows(frame, aids, config_.pgv_arrow);
    add_cone_and_plane(frame, aids);
    add_marker(frame, hit.situation.look_at_m, 0.006 * aids.scale, kLookAtColour);
  } else if (percept_known(moment) && moment.state.percept.closeness > 0) {
    add_arrows(frame, live_aids(moment), config_.pgv_arrow);
  }
  if (view == View::kMain && hit.alert != 0)
    add_marker(frame, hit.situation.look_at_m, 0.016 * scene_.scale(), kLookAtColour);
  add_contact(frame, moment);
}

Compositor::Picture Compositor::main_picture(const Moment& moment, const HitView& hit) const {
  Hud hud = main_hud(moment);
  Frame frame = frame_from(moment, View::kMain, main_home(), hud);
  add_aids(frame, View::kMain, moment, hit);
  return {std::move(frame), std::move(hud)};
}

Compositor::Picture Compositor::hit_picture(const Moment& moment, const HitView& hit) const {
  Hud hud = hit_hud(moment, hit);
  Frame frame = frame_from(moment, View::kHit, hit_home(hit), hud);
  add_aids(frame, View::kHit, moment, hit);
  return {std::move(frame), std::move(hud)};
}

Compositor::Picture Compositor::tool_picture(const Moment& moment) const {
  Hud hud;
  hud.title = said({"hud.tool", {}});
  hud.banner = banner_text(moment.state, config_.staleness, moment.now_ns, config_.language);
  Frame frame = frame_from(moment, View::kTool, tool_home(moment.state), hud);
  add_aids(frame, View::kTool, moment, {});
  return {std::move(frame), std::move(hud)};
}

Compositor::Picture Compositor::camera_picture(const Moment& then, const Moment& now,
                                               const VideoMoment& video, const HitView& hit) const {
  Hud hud;
  hud.title = said({"hud.camera", {{"name", video.name}}});
  hud.banner = video.live ? banner_text(now.state, config_.staleness, now.now_ns, config_.language)
                          : said(video.problem);
  hud.alarm = !video.live;
  const RecordingState& recording = now.state.recording;
  hud.recording = recording.running && recording.view == View::kCamera;
  Frame frame;
  if (video.live) {
    frame = scene_.frame_over_video(then.state, config_.staleness, then.now_ns, video.camera.eye_m);
    hud.subtitle = video_text(video, then.state.arm.received_ns != 0, config_.language);
    if (percept_known(then) && then.state.percept.closeness > 0)
      add_arrows(frame, live_aids(then), config_.pgv_arrow);
    if (hit.alert != 0) {
      const Aids aids = hit_aids(then, hit);
      add_cone_and_plane(frame, aids);
      add_marker(frame, hit.situation.look_at_m, 0.006 * aids.scale, kLookAtColour);
    }
    add_contact(frame, then);
  }
  frame.camera = video.camera;
  frame.backdrop = video.picture;
  return {std::move(frame), std::move(hud)};
}

Hud Compositor::main_hud(const Moment& moment) const {
  const ViewerState& state = moment.state;
  const PerceptSample& percept = state.percept;
  Hud hud;
  hud.language = config_.language;
  hud.title = cell_;
  hud.banner = banner_text(state, config_.staleness, moment.now_ns, config_.language);
  hud.gauges = true;
  hud.closeness_known = percept_known(moment);
  hud.closeness = percept.closeness;
  hud.speed_m_s = percept.speed_m_s;
  hud.motion = percept.motion;
  const bool near = hud.closeness_known && percept.closeness > 0;
  hud.nearest =
      near ? scene_.link_name(percept.link) + " - " + object_name(state, percept.object, config_.language)
           : "-";
  hud.link_state = state.arm.received_ns == 0 ? "-" : said({"link_state." + label_of(state.arm.state), {}});
  hud.link_quality = link_text(state);
  hud.model_age = age_text(age_s(state.arm.received_ns, moment.now_ns));
  hud.voxel_error = voxel_error_text(state.workspace);
  if (state.arm.contact && hud.banner.empty()) {
    hud.subtitle = said({"vicinity.contact", {{"object", touched_object(state)}}});
  }
  return hud;
}

/// Returns from where the zone is seen, and of an alert that is known what threatens to hit what.
std::vector<LocalizedText> Compositor::hit_title(const ViewerState& state, const HitView& hit) const {
  if (hit.approach)
    return {{"hud.approach", {{"direction", direction_words(hit.node, config_.main_view.azimuth_rad)}}},
            {"hud.gap",
             {{"object", object_words(state, hit.approach->object)}, {"gap_mm", 1e3 * hit.approach->gap_m}}}};
  std::vector<LocalizedText> title{
      {state.hold ? "hud.hit_held" : "hud.hit",
       {{"direction", direction_words(hit.node, config_.main_view.azimuth_rad)}}}};
  const auto record = std::find_if(state.hits.rbegin(), state.hits.rend(),
                                   [&hit](const HitRecord& one) { return one.raised.alert == hit.alert; });
  if (record == state.hits.rend()) return title;
  const HitSample& raised = record->raised;
  title.push_back({hit.threatening ? "hud.alert" : "hud.alert_over",
                   {{"alert", static_cast<double>(hit.alert)},
                    {"link", raised.link_name.empty() ? scene_.link_name(raised.link) : raised.link_name},
                    {"object", object_words(state, raised.object)}}});
  return title;
}

Hud Compositor::hit_hud(const Moment& moment, const HitView& hit) const {
  const ViewerState& state = moment.state;
  const std::vector<LocalizedText> title = hit_title(state, hit);
  Hud hud;
  hud.title = said(title.front());
  if (title.size() > 1) hud.subtitle = said(title.back());
  hud.alarm = hit.threatening;
  hud.banner = banner_text(state, config_.staleness, moment.now_ns, config_.language);
  return hud;
}

}  // namespace phantom::synthetic_viewer

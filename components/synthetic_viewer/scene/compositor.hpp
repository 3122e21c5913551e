#pragma once

#include <array>
#include <string>
#include <vector>

#include "components/synthetic_viewer/scene/aids.hpp"
#include "components/synthetic_viewer/scene/camera_view.hpp"
#include "components/synthetic_viewer/scene/cell_scene.hpp"
#include "components/synthetic_viewer/scene/hud.hpp"
#include "components/synthetic_viewer/scene/scene_config.hpp"

namespace phantom::synthetic_viewer {

/// Returns a function that gives the visible share of a hit zone among `bodies`, from where the camera would
/// be placed: for a node inside a wall, from the nearest free position. `bodies` must outlive the function.
/// `scale`: of the scene (scene_scale()).
VisibleShare visible_among(const RayScene& bodies, double scale);
/// Returns the rule of the hit zone's view for a scene of that scale.
HitViewConfig at_scale(HitViewConfig config, double scale);

/// Composes the views: what is in each frame, and the text over it. Pure: state in, frames and texts out.
class Compositor {
 public:
  Compositor(const SceneConfig& config, std::string cell, const CellScene& scene)
      : config_(config), cell_(std::move(cell)), scene_(scene) {}

  /// The content of a picture and the text over it. The subtitle says so if the camera had to be moved
  /// because a body was in its place.
  struct Picture {
    Frame frame;
    Hud hud;
    std::shared_ptr<const Image> inset = nullptr;  ///< a picture in the upper right of it; null: none
  };

  /// The inputs of a picture.
  struct Moment {
    const ViewerState& state;
    const RayScene& objects;  ///< obstacles without the arm
    const RayScene& bodies;   ///< obstacles with the arm
    core::Nanoseconds now_ns;
  };

  /// Adds to a frame what a view shows besides the cell's bodies: arrows, cone and plane, marks.
  void add_aids(Frame& frame, View view, const Moment& moment, const HitView& hit) const;

  /// Where the cameras stand by themselves, whatever the operator has turned.
  struct Homes {
    UnobstructedCamera main, hit;                    ///< `hit` of a zone that is shown
    LocalizedText main_note;                         ///< what was in the main camera's way; empty: nothing
    std::array<double, percept::kNodeCount> free_m;  ///< from the look-at point to the camera at each node
    std::vector<LocalizedText> title;                ///< of the hit zone's view, a line each
  };
  Homes homes(const Moment& moment, const HitView& hit) const;
  /// Returns the share of the way from the point that the camera on the arm looks at to that camera which is
  /// free.
  double tool_free_share(const Moment& moment) const;

  /// Returns the picture of the whole cell, with the arrows of the worst sensor and a mark on the zone of
  /// `hit`.
  Picture main_picture(const Moment& moment, const HitView& hit) const;
  /// Returns the picture of the hit zone with cone and plane.
  Picture hit_picture(const Moment& moment, const HitView& hit) const;
  /// Return the present cameras of the main view and of the hit zone's view.
  Camera main_camera(const Moment& moment) const;
  Camera hit_camera(const Moment& moment, const HitView& hit) const;
  /// Returns the picture from the camera on the arm's last link.
  Picture tool_picture(const Moment& moment) const;
  /// Returns a real camera's picture with edges, paint, arrows and the cone of `hit` over it, all as they
  /// were when it was exposed: `then` is the state of that time, whose now_ns it is. Nothing is drawn over a
  /// picture that is not live. `now`: of the banner.
  Picture camera_picture(const Moment& then, const Moment& now, const VideoMoment& video,
                         const HitView& hit) const;

 private:
  Frame frame_from(const Moment& moment, View view, const Camera& camera, Hud& hud) const;
  Camera main_home() const;
  Camera hit_home(const HitView& hit) const;
  Camera tool_home(const ViewerState& state) const;
  std::string said(const LocalizedText& words) const { return in(config_.language, words); }
  LocalizedText note_of(const ViewerState& state, const UnobstructedCamera& place) const;
  std::vector<LocalizedText> hit_title(const ViewerState& state, const HitView& hit) const;
  Hud main_hud(const Moment& moment) const;
  Hud hit_hud(const Moment& moment, const HitView& hit) const;
  bool percept_known(const Moment& moment) const;
  Aids live_aids(const Moment& moment) const;
  Aids threat_aids(const Moment& moment, const messages::Threat& threat) const;
  Aids hit_aids(const Moment& moment, const HitView& hit) const;
  double gap_m(const RayScene& objects, const Eigen::Vector3d& from_m, const Eigen::Vector3d& pgv,
               std::uint16_t object) const;
  void set_size(Aids& aids, double thickness_m) const;
  void add_contact(Frame& frame, const Moment& moment) const;

  const SceneConfig& config_;
  std::string cell_;
  const CellScene& scene_;
};

}  // namespace phantom::synthetic_viewer

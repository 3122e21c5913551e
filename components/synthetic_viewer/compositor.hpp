#pragma once

#include <string>

#include "components/synthetic_viewer/aids.hpp"
#include "components/synthetic_viewer/cell_scene.hpp"
#include "components/synthetic_viewer/config.hpp"
#include "components/synthetic_viewer/hud.hpp"

namespace phantom::synthetic_viewer {

/// Of a hit zone, seen from where the camera will stand among `bodies`, which must outlive the answer: a node
/// inside a wall counts by its nearest free place.
VisibleShare visible_among(const RayScene& bodies);

/// Composes the views: what is in each frame, and what is written over it. Pure: state in, frames and texts
/// out.
class Compositor {
 public:
  Compositor(const ViewerConfig& config, std::string cell, const CellScene& scene)
      : config_(config), cell_(std::move(cell)), scene_(scene) {}

  /// What a picture shows, and what is written over it. Where the camera had to give way to a body, the
  /// subtitle says so.
  struct Picture {
    Frame frame;
    Hud hud;
  };

  /// What a picture is made from.
  struct Moment {
    const ViewerState& state;
    const RayScene& objects;  ///< without the arm
    const RayScene& bodies;   ///< with it
    core::Nanoseconds now_ns;
  };

  /// The whole cell, with the arrows of the worst sensor, and a mark on the zone of `hit`.
  Picture main_picture(const Moment& moment, const HitView& hit) const;
  /// The hit zone with cone and plane.
  Picture hit_picture(const Moment& moment, const HitView& hit) const;
  /// From where the main view is seen now, and the hit zone's.
  Camera main_camera(const Moment& moment) const;
  Camera hit_camera(const Moment& moment, const HitView& hit) const;
  /// From the arm's last link.
  Picture tool_picture(const Moment& moment) const;

 private:
  Frame frame_from(const Moment& moment, View view, const Camera& camera, Hud& hud) const;
  Camera main_home() const;
  Camera hit_home(const HitView& hit) const;
  Hud main_hud(const Moment& moment) const;
  Hud hit_hud(const Moment& moment, const HitView& hit) const;
  bool percept_known(const Moment& moment) const;
  Aids live_aids(const Moment& moment) const;
  Aids hit_aids(const Moment& moment, const HitView& hit) const;
  double gap_m(const RayScene& objects, const Eigen::Vector3d& from_m, const Eigen::Vector3d& pgv) const;
  void add_contact(Frame& frame, const Moment& moment) const;

  const ViewerConfig& config_;
  std::string cell_;
  const CellScene& scene_;
};

}  // namespace phantom::synthetic_viewer

#pragma once

#include <string>
#include <vector>

#include "common/runtime/cell.hpp"
#include "components/synthetic_viewer/arm_meshes.hpp"
#include "components/synthetic_viewer/compositor.hpp"
#include "components/synthetic_viewer/mesh_assembler.hpp"

namespace phantom::synthetic_viewer {

/// The cell as the viewer draws it: its meshes and paint on the graphics card, where everything stands now,
/// which hit zone is shown and from where. Owns the OpenGL context: made, used and destroyed on one thread.
/// Times are of CLOCK_MONOTONIC.
class Drawing {
 public:
  /// Draws what `state` tells as `config` says; both must outlive this. `min_m`, `max_m`: the workspace's box
  /// in W. Throws core::MissingError if there is no OpenGL.
  Drawing(const ViewerConfig& config, const runtime::CellConfig& cell, robot::SerialArm arm,
          const std::vector<LinkMeshData>& arm_meshes, const ViewerState& state);

  /// A part of a mesh. An error if it is refused; one that came before is ignored.
  core::Status take(MeshChunkSample chunk);
  /// A hit zone to show, or one that need not be shown any more.
  void take(const HitSample& hit);
  /// Paints the links of which any patch feels in `skin`, or did in the state's.
  void paint(const SkinSample& skin);

  /// One round later: looks where everything stands, and chooses the hit zone and its node. True if the zone
  /// is another alert's than before.
  bool advance(core::Nanoseconds now_ns, double dt_s);

  const CellScene& scene() const { return scene_; }
  /// The hit zone that is shown; alert 0: none.
  const HitView& hit_view() const { return hit_; }
  /// How the view stands that the operator looks at: the hit zone's while one is shown, else the main view.
  ViewPoseSample view_pose() const;

  /// What a view shows now; the hit zone's only while there is one.
  Compositor::Picture picture(View view) const;
  struct AlertPicture {
    Compositor::Picture picture;
    ViewNode node = ViewNode::kAutomatic;
  };
  /// An alert's zone with arm and percept as they were when it came, which may be long ago: as it is shown,
  /// or from the node that suits it while another alert is shown.
  AlertPicture picture(const HitSample& hit) const;

  const PictureFormat& format(View view) const;
  /// A fine picture for the report; nothing if `give_up` said yes on the way.
  std::optional<Image> photograph(Compositor::Picture picture, const GiveUp& give_up);

  Renderer& renderer() { return renderer_; }

 private:
  Compositor::Moment now() const { return {state_, objects_, bodies_, now_ns_}; }

  const ViewerConfig& config_;
  const ViewerState& state_;
  Renderer renderer_;
  CellScene scene_;
  Compositor compositor_;
  std::vector<geometry::BoundingBox> link_boxes_;
  MeshAssembler assembler_;
  SyntheticViewer viewer_;
  HitView hit_;
  RayScene objects_, bodies_;  // where they stand now, without and with the arm
  core::Nanoseconds now_ns_ = 0;
};

}  // namespace phantom::synthetic_viewer

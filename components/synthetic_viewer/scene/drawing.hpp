#pragma once

#include <map>
#include <string>
#include <vector>

#include "common/messages/mesh_assembler.hpp"
#include "common/runtime/cell/cell.hpp"
#include "components/synthetic_viewer/scene/arm_meshes.hpp"
#include "components/synthetic_viewer/scene/compositor.hpp"
#include "components/synthetic_viewer/scene/mesh_store.hpp"
#include "components/synthetic_viewer/scene/pose_calibration.hpp"
#include "components/synthetic_viewer/scene/scene_base.hpp"
#include "components/synthetic_viewer/scene/tool_approach.hpp"

namespace phantom::synthetic_viewer {

/// The cell as the viewer draws it: its meshes and paint on the graphics card, the present positions of all
/// bodies, and which hit zone is shown from where. Owns the OpenGL context: created, used and destroyed on
/// one thread. Times are of CLOCK_MONOTONIC.
class Drawing {
 public:
  /// Draws `state` as `config` says; both must outlive this. `min_m`, `max_m`: the workspace's box in W.
  /// `kept`: where the meshes are kept for browsers; null: nowhere. It must outlive this.
  /// Throws core::MissingError if there is no OpenGL, and as load_other_arms() for those of `config`.
  Drawing(const SceneConfig& config, const runtime::CellConfig& cell, robot::SerialArm arm,
          const std::vector<LinkMeshData>& arm_meshes, const ViewerState& state,
          std::size_t most_triangles = kMaxTriangles, MeshStore* kept = nullptr);

  /// Greatest number of meshes, and of their triangles in all.
  static constexpr std::size_t kMaxMeshes = 65536, kMaxTriangles = std::size_t{1} << 25;

  /// Takes a part of a mesh. Returns an error if it is refused; a part of a complete mesh is ignored. If
  /// there is no room for a mesh, those that no object names are given up for it, the oldest first.
  core::Status take(MeshChunkSample chunk);
  /// Returns the number of meshes that were given up for others, complete or not.
  /// A mesh is kept for this long after its last object was removed.
  static constexpr core::Nanoseconds kKeepUnnamed_ns = 30 * core::kNsPerSecond;
  /// Drops such meshes. To be called about once a second; not while a recording is shown, whose meshes come
  /// once.
  void drop_meshes_of_removed_objects(core::Nanoseconds now_ns);
  std::uint64_t meshes_given_up() const { return given_up_ + assembler_.given_up(); }
  /// Takes a raised alert, whose hit zone is to be shown, or a cleared one.
  void take(const HitSample& hit);
  /// Forgets which zone is shown, and chooses it anew as if the state's alerts had come one after the other
  /// until `now_ns`.
  void resume(core::Nanoseconds now_ns);
  /// Repaints the links on which any patch feels something in `skin`, or did in the skin of the state.
  void paint(const SkinSample& skin);

  /// Shows objects of live matter by these surfaces in W, by their ids; others by their objects' meshes.
  void show_live(const std::map<std::uint16_t, geometry::TriangleMesh>& shapes);

  /// Advances by one round: updates the positions of all bodies, and chooses the hit zone and its node.
  /// Returns true if the zone belongs to another alert than before.
  bool advance(core::Nanoseconds now_ns, double dt_s);

  const CellScene& scene() const { return scene_; }
  /// Returns the hit zone that is shown; alert 0: none.
  const HitView& hit_view() const { return hit_; }
  /// Returns what is known for who draws the scene elsewhere.
  SceneBase scene_base() const;
  /// Returns the pose of the view that the operator looks at: of the hit zone's while one is shown, else of
  /// the main view.
  ViewPoseSample view_pose() const;

  /// Returns what a view shows now. The hit zone's view exists only while there is a zone.
  Compositor::Picture picture(View view) const;
  struct AlertPicture {
    Compositor::Picture picture;
    ViewNode node = ViewNode::kAutomatic;
  };
  /// Returns the picture of an alert's zone with arm and percept as they were when it came, which may be long
  /// ago. If the alert is the one that is shown, the picture is from the same node; otherwise from the node
  /// that suits it.
  AlertPicture picture(const HitSample& hit) const;

  /// Returns the known corners of the objects that stand in the workspace.
  std::vector<KnownCorner> known_corners() const;
  const RayScene& bodies() const { return bodies_; }
  /// Gives the drawing a real camera's view; `view` must outlive it.
  void attach(CameraView& view) { camera_view_ = &view; }
  /// Takes the camera's newest picture, and the skin's paint of its time, for picture(View::kCamera). Returns
  /// whether there is a camera.
  /// `now_ns`: the present time; a round may have begun long ago.
  bool take_video(core::Nanoseconds now_ns);

  const PictureFormat& format(View view) const;
  /// Renders a picture for the report at its higher quality. Returns nothing if `give_up` returned true
  /// meanwhile.
  std::optional<Image> report_picture(Compositor::Picture picture, const CancelCheck& give_up);

  Renderer& renderer() { return renderer_; }

 private:
  void follow_threats();
  using Meshes = std::map<std::uint64_t, MeshBody>;
  bool make_room(std::size_t triangles);
  Meshes::iterator drop(Meshes::iterator mesh);
  Compositor::Picture camera_picture() const;
  HitView tool_view(double dt_s);
  void paint_links(const SkinSample& skin, const std::vector<SkinPatchSample>& before, PaintHandle first);
  Compositor::Moment now() const { return {state_, objects_, bodies_, now_ns_}; }

  const SceneConfig& config_;
  const ViewerState& state_;
  const std::size_t most_triangles_;
  MeshStore* const kept_;
  Renderer renderer_;
  CellScene scene_;
  Compositor compositor_;
  std::vector<geometry::BoundingBox> link_boxes_;
  messages::MeshAssembler assembler_;
  std::size_t triangles_ = 0;  // of all meshes of the scene
  std::uint64_t next_order_ = 0, given_up_ = 0;
  SyntheticViewer viewer_;
  ToolApproach approach_;
  HitView hit_;
  CameraView* camera_view_ = nullptr;  // null: no real camera
  VideoMoment video_;
  std::vector<SkinPatchSample> felt_over_video_;
  std::uint64_t paint_number_over_video_ = 0;
  mutable std::shared_ptr<const CellScene> scene_copy_;  // for scene_base(); null: the scene has changed
  RayScene objects_, bodies_;                            // present obstacles, without and with the arm
  core::Nanoseconds now_ns_ = 0;
};

}  // namespace phantom::synthetic_viewer

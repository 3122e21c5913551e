#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/core/clock.hpp"
#include "common/robot/kinematics/serial_arm.hpp"
#include "common/runtime/cell/cell.hpp"
#include "components/synthetic_viewer/render/feature_edges.hpp"
#include "components/synthetic_viewer/render/frame.hpp"
#include "components/synthetic_viewer/render/ray_scene.hpp"
#include "components/synthetic_viewer/render/renderer.hpp"
#include "components/synthetic_viewer/scene/arm_meshes.hpp"
#include "components/synthetic_viewer/state/state.hpp"

namespace phantom::synthetic_viewer {

/// A mesh for drawing and as an obstacle for rays.
struct MeshBody {
  MeshHandle picture = kNoMesh;
  std::shared_ptr<const RayMesh> obstacle;
  std::size_t triangles = 0;
  std::uint64_t order = 0;                          ///< rises with each mesh that is uploaded
  std::uint64_t hash = 0;                           ///< of its content
  std::shared_ptr<const EdgeMesh> edges = nullptr;  ///< null: not asked for
  /// Thickness, m: 4·volume ÷ area, which is the diameter of a long bar, and twice the thickness of a plate;
  /// 0: the mesh encloses nothing.
  double thickness_m = 0.0;
  geometry::BoundingBox box = {};    ///< of the mesh, in its own frame
  bool was_named = false;            ///< an object of the cell has had it
  core::Nanoseconds unnamed_ns = 0;  ///< since when none has it any more; 0: one has, or none had
};

/// A mesh that moves with a link.
struct LinkBody {
  std::size_t link = 0;
  geometry::Pose X_link_mesh;
  Colour colour{};
  MeshBody body;
  geometry::BoundingBox box;                            ///< of the mesh, in its own frame
  Eigen::Vector3d closing_m = Eigen::Vector3d::Zero();  ///< see LinkMeshData
};

/// Returns X_link_mesh with the gripper as it was last heard of; at its widest while it was not.
geometry::Pose pose_in_link(const LinkBody& part, const GripperSample& gripper);

/// One mesh of the cell, and what it rides on. It changes only when something else than the arm's joints
/// does.
struct SceneItem {
  /// kBound: an object once more, translucent, as far as it may reach by the error of its pose.
  enum class Kind : std::uint8_t { kObject, kPart, kOtherPart, kBound };
  Kind kind = Kind::kObject;
  /// The object's id, or the part's place in CellScene::links; of another arm's in its links, and that arm's
  /// place times 65,536 more.
  std::size_t number = 0;
  const MeshBody* mesh = nullptr;
  int body = kWorld;    ///< number in CellScene::body_poses(); kWorld: it stands in W
  geometry::Pose X_BM;  ///< mesh frame in the body's
  Colour colour{};
  float opacity = 1.0F;
  bool casts_shadow = true;
  bool painted = false;  ///< takes its link's paint
  std::size_t link = 0;  ///< of a part
  double grown_m = 0.0;  ///< by so much it is larger than its mesh, on each side of its box
  static constexpr int kWorld = -1;
};

/// Returns the ids of a cell's protected zones.
std::set<std::uint16_t> zones_of(const runtime::CellConfig& cell);

/// Returns the affine transform of an item's mesh whose frame is at X_M: rigid, but for an item that is
/// grown.
Eigen::Matrix4d placement_of(const SceneItem& item, const geometry::Pose& X_M);

/// Returns the number that tells an item from all others: kind and number.
inline std::uint64_t key_of(const SceneItem& item) {
  return static_cast<std::uint64_t>(item.kind) << 32 | item.number;
}

/// Returns whether the skin's percept is fresh, and so to be seen on the arm.
bool paint_shown(const ViewerState& state, const Staleness& staleness, core::Nanoseconds now_ns);
/// Returns the colours of closeness 0, 0.5 and 1.
std::array<Colour, 3> paint_ramp();

/// Returns MeshBody::thickness_m of a mesh.
double thickness_of(const geometry::TriangleMesh& mesh);
/// Uploads a mesh to `renderer` and prepares it for rays; `with_edges`: also for being drawn as lines.
MeshBody uploaded(const geometry::TriangleMesh& mesh, Renderer& renderer, bool with_edges = false);
LinkBody uploaded(const LinkMeshData& part, Renderer& renderer, bool with_edges = false);

/// The handles of the paint over video, which is that of another time, are those of the links and this.
inline constexpr PaintHandle kPaintOverVideo = 1U << 16;

/// Places the cell's bodies: turns the viewer's state into a frame. Pure once its meshes are set.
class CellScene {
 public:
  /// `min_m`, `max_m`: the workspace box in W. `arm_name`: in the cell file.
  CellScene(robot::SerialArm arm, const Eigen::Vector3d& min_m, const Eigen::Vector3d& max_m,
            std::string arm_name = {})
      : arm_(std::move(arm)),
        arm_name_(std::move(arm_name)),
        min_m_(min_m),
        max_m_(max_m),
        scale_(scene_scale(min_m, max_m)) {}

  std::vector<LinkBody> links;
  /// The objects that are protected zones, by id: see-through, and no obstacle to the sight.
  std::set<std::uint16_t> zones;
  static constexpr double kShownError_m = 0.001;  ///< times scale()
  std::map<std::uint64_t, MeshBody> meshes;       ///< by content hash
  /// Surfaces of live matter in W, by its ids, which pictures show instead of its objects' meshes.
  std::map<std::uint16_t, MeshBody> live;
  std::uint64_t paint_number = 0;  ///< increases with every change of the arm's paint
  struct OtherArm {
    std::string name;
    robot::SerialArm arm;
    std::vector<LinkBody> links;
  };
  std::vector<OtherArm> others;  ///< in the order of ViewerState::others

  /// Returns the frame with objects, arm, floor and the outline of the workspace. Protected zones are
  /// translucent and cast no shadow. What may be off by more
  /// than kShownError_m is drawn twice: translucent as far as it may reach. The arm is painted while the
  /// skin's percept is fresh. It is translucent if its pose is out of date, and not drawn if no pose is
  /// known; so is what it carries, and so is another arm that is heard of, while this one's pose is known.
  /// What other arms carry is not drawn: where it is is not known.
  Frame frame(const ViewerState& state, const Staleness& staleness, core::Nanoseconds now_ns) const;

  /// Returns the frame to be drawn over a picture of the same bodies: their edges as seen from `eye_m`, their
  /// paint, and nothing of the floor; protected zones are translucent over it. An arm whose pose is out of
  /// date or not known is not drawn; nor is what it carries; nor are other arms while this one's pose is not
  /// known.
  Frame frame_over_video(const ViewerState& state, const Staleness& staleness, core::Nanoseconds now_ns,
                         const Eigen::Vector3d& eye_m) const;
  /// Returns the meshes of that frame and what each rides on, in the same order.
  std::vector<SceneItem> items(const ViewerState& state, const Staleness& staleness,
                               core::Nanoseconds now_ns) const;
  /// Returns the poses in W of all that items ride on: the links, then the fingers of a gripper as it was
  /// last heard of, at its widest while it was not, then the links of other arms, in W while nothing rides on
  /// them. Empty while the arm's pose is not known.
  std::vector<geometry::Pose> body_poses(const ViewerState& state) const;
  /// Returns the number of this arm's bodies and the link that each belongs to.
  std::vector<std::size_t> body_links() const;
  /// Returns the names of the other arms' bodies, such as "scara_b: inner".
  std::vector<std::string> other_bodies() const;

  /// Returns the mesh that was uploaded longest ago among those that no object names; the end if each is
  /// named.
  std::map<std::uint64_t, MeshBody>::iterator oldest_unnamed(const ViewerState& state);

  /// Returns whether a part of an arm has the mesh of that hash.
  bool is_of_arm(std::uint64_t hash) const;
  /// Returns the bounding boxes of the links' bodies, in the links' frames, by link; empty for a link without
  /// a body.
  std::vector<geometry::BoundingBox> link_boxes() const;

  /// Returns the thickness of an object; 0: not known.
  double thickness_m(const ViewerState& state, std::uint16_t object) const;

  /// Returns the obstacles for rays: the objects (zones apart) and, if `with_arm`, the arms whose poses are
  /// known, this one with what it carries.
  RayScene obstacles(const ViewerState& state, bool with_arm) const;

  const robot::SerialArm& arm() const { return arm_; }
  const Eigen::Vector3d& min_m() const { return min_m_; }
  const Eigen::Vector3d& max_m() const { return max_m_; }
  double scale() const { return scale_; }  ///< scene_scale() of the workspace
  /// Returns points of the surface of what the arm's last link with a body has, and of what it carries, in W:
  /// `most` at most of each part. The arm's pose must be known.
  std::vector<Eigen::Vector3d> tool_points(const ViewerState& state, std::size_t most) const;
  /// Returns the link's name, such as "forearm" or "link 3".
  std::string link_name(std::size_t link) const;
  /// Returns the name of what an item shows.
  std::string item_name(const ViewerState& state, const SceneItem& item) const;
  /// Returns whether every object has its mesh; false while there are no objects.
  bool complete(const ViewerState& state) const;
  /// Returns the names of the objects whose mesh is missing.
  std::vector<std::string> missing(const ViewerState& state) const;
  /// Returns the display name of a body that a ray meets.
  std::string body_name(const ViewerState& state, const RayScene::BodyName& name) const;

 private:
  std::optional<geometry::Pose> pose_of(const ObjectSample& object, const ViewerState& state) const;
  bool place(const ObjectSample& object, const ViewerState& state, SceneItem& item) const;
  void add_others(const ViewerState& state, const Staleness& staleness, core::Nanoseconds now_ns,
                  std::vector<SceneItem>& items) const;

  robot::SerialArm arm_;
  std::string arm_name_;
  Eigen::Vector3d min_m_, max_m_;
  double scale_;
};

/// Returns one sentence about what is missing; empty if nothing is.
LocalizedText missing_words(const ViewerState& state, const CellScene& scene, const Staleness& staleness,
                            core::Nanoseconds now_ns);

}  // namespace phantom::synthetic_viewer

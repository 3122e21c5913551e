#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <vector>

#include "common/robot/serial_arm.hpp"
#include "components/synthetic_viewer/arm_meshes.hpp"
#include "components/synthetic_viewer/frame.hpp"
#include "components/synthetic_viewer/ray_scene.hpp"
#include "components/synthetic_viewer/renderer.hpp"
#include "components/synthetic_viewer/state.hpp"

namespace phantom::synthetic_viewer {

/// A mesh as picture and as obstacle.
struct MeshBody {
  MeshHandle picture = kNoMesh;
  std::shared_ptr<const RayMesh> obstacle;
};

/// A mesh that moves with a link.
struct LinkBody {
  std::size_t link = 0;
  geometry::Pose X_link_mesh;
  Colour colour{};
  MeshBody body;
  geometry::BoundingBox box;  ///< of the mesh, in its own frame
};

/// A mesh, given to `renderer` and prepared for rays.
MeshBody uploaded(const geometry::TriangleMesh& mesh, Renderer& renderer);
LinkBody uploaded(const LinkMeshData& part, Renderer& renderer);

/// Places the cell's bodies: from what the viewer knows to what a frame shows. Pure, once its meshes are put
/// in.
class CellScene {
 public:
  /// `min_m`, `max_m`: the workspace box in W.
  CellScene(robot::SerialArm arm, const Eigen::Vector3d& min_m, const Eigen::Vector3d& max_m)
      : arm_(std::move(arm)), min_m_(min_m), max_m_(max_m) {}

  std::vector<LinkBody> links;
  std::map<std::uint64_t, MeshBody> meshes;  ///< by content hash
  std::uint64_t paint_number = 0;            ///< rises with every change of the arm's paint

  /// Objects, arm, floor and the outline of the workspace. The arm wears its paint while the skin's percept
  /// is fresh; a pose that is out of date is see-through; an arm whose pose nobody told is not drawn.
  Frame frame(const ViewerState& state, const Staleness& staleness, core::Nanoseconds now_ns) const;

  /// Boxes around the links' bodies, in the links' frames, by link; empty where a link has no body.
  std::vector<geometry::BoundingBox> link_boxes() const;

  /// What rays meet: the objects, and the arm where it is known.
  RayScene obstacles(const ViewerState& state, bool with_arm) const;

  const robot::SerialArm& arm() const { return arm_; }
  const Eigen::Vector3d& min_m() const { return min_m_; }
  const Eigen::Vector3d& max_m() const { return max_m_; }
  /// "forearm" or "link 3".
  std::string link_name(std::size_t link) const;
  /// Whether every object has its mesh; false while there are none.
  bool complete(const ViewerState& state) const;
  /// Names of the objects whose mesh is not there.
  std::vector<std::string> missing(const ViewerState& state) const;
  /// Whose a body is that rays meet.
  std::string body_name(const ViewerState& state, const RayScene::BodyName& name) const;

 private:
  robot::SerialArm arm_;
  Eigen::Vector3d min_m_, max_m_;
};

/// One sentence about what is missing; empty if nothing is.
std::string missing_text(const ViewerState& state, const CellScene& scene, const Staleness& staleness,
                         core::Nanoseconds now_ns);

}  // namespace phantom::synthetic_viewer

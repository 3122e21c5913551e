#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <vector>

#include "common/robot/serial_arm.hpp"
#include "components/synthetic_viewer/frame.hpp"
#include "components/synthetic_viewer/ray_scene.hpp"
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
};

/// Places the cell's bodies: from what the viewer knows to what a frame shows. Pure, once its meshes are put
/// in.
class CellScene {
 public:
  /// `min_m`, `max_m`: the workspace box in W.
  CellScene(robot::SerialArm arm, const Eigen::Vector3d& min_m, const Eigen::Vector3d& max_m)
      : arm_(std::move(arm)), min_m_(min_m), max_m_(max_m) {}

  std::vector<LinkBody> links;
  std::map<std::uint64_t, MeshBody> meshes;  ///< by content hash

  /// Objects, arm, floor and the outline of the workspace. The arm is painted by the closeness of its worst
  /// link; a pose that is out of date is see-through; an arm whose pose nobody told is not drawn.
  Frame frame(const ViewerState& state, const Staleness& staleness, core::Nanoseconds now_ns) const;

  /// What rays meet: the objects, and the arm where it is known.
  RayScene obstacles(const ViewerState& state, bool with_arm) const;

  const robot::SerialArm& arm() const { return arm_; }
  const Eigen::Vector3d& min_m() const { return min_m_; }
  const Eigen::Vector3d& max_m() const { return max_m_; }
  /// "forearm" or "link 3".
  std::string link_name(std::size_t link) const;
  /// Whether every object has its mesh; false while there are none.
  bool complete(const ViewerState& state) const;

 private:
  robot::SerialArm arm_;
  Eigen::Vector3d min_m_, max_m_;
};

}  // namespace phantom::synthetic_viewer

#pragma once

#include <string>
#include <vector>

#include "common/geometry/mesh/mesh.hpp"
#include "common/robot/kinematics/serial_arm.hpp"
#include "common/robot/skin/skin.hpp"
#include "common/runtime/cell/cell.hpp"
#include "common/runtime/cell/other_arms.hpp"
#include "components/synthetic_viewer/samples/samples.hpp"

namespace phantom::synthetic_viewer {

/// A loaded visual mesh of a link.
struct LinkMeshData {
  std::size_t link = 0;
  geometry::Pose X_link_mesh;
  std::array<float, 3> colour{};
  geometry::TriangleMesh mesh;
  Eigen::Vector3d closing_m =
      Eigen::Vector3d::Zero();  ///< in the link's frame: its way when the gripper closes
};

/// Loads all visual meshes of the arm. A moving link that has none (from a DH table, or a URDF without
/// visuals) is shown as the body that its skin encloses. Throws core::MissingError for a file that does not
/// exist, core::ConfigError for one that is no usable mesh.
std::vector<LinkMeshData> load_arm_meshes(const robot::SerialArm& arm,
                                          const std::vector<robot::LinkSkin>& skin);

/// Another arm of the cell, and what is seen of it.
struct OtherArmData {
  std::string name;
  robot::SerialArm arm;
  std::vector<LinkMeshData> meshes;
};
/// Loads the arms of `others`. Throws as load_arm_meshes(), and core::ConfigError for an arm that the cell
/// does not have, that is `own`, or that stands twice.
std::vector<OtherArmData> load_other_arms(const runtime::CellConfig& cell, const std::string& own,
                                          const std::vector<runtime::OtherArmConfig>& others);

/// Returns where the states of those arms come from; `configured`: of the same arms.
std::vector<OtherArmSource> sources_of(const std::vector<OtherArmData>& arms,
                                       const std::vector<runtime::OtherArmConfig>& configured);

/// Sets the ways of a gripper's fingers: from where `meshes` are, of the arm with the gripper at its widest,
/// to where they are in `closed`.
void set_closing(const robot::SerialArm& closed, std::vector<LinkMeshData>& meshes);

/// Returns the closed body between the polygons at a segment's ends, in the frame of the link that the skin
/// names. Pure.
geometry::TriangleMesh segment_body(const robot::SkinSegment& segment);

}  // namespace phantom::synthetic_viewer

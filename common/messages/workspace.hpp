#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/core/sample_id.hpp"
#include "common/geometry/pose.hpp"
#include "common/workspace/workspace_assembler.hpp"
#include "phantom_contract/workspace_samples.hpp"

// The samples of the topics of idl/workspace.idl as components use them.

namespace phantom::messages {

/// Topic workspace_object: an object in the workspace, and its pose.
struct WorkspaceObject {
  std::uint16_t id = 0;  ///< as in the voxels
  std::string name;
  std::uint64_t mesh_hash = 0;    ///< mesh_chunk's key; 0: the object was removed, and only `id` is valid
  geometry::Pose X_WO;            ///< object frame in W
  std::array<float, 3> colour{};  ///< linear RGB, 0…1

  bool removed() const { return mesh_hash == 0; }
};

/// An object that an arm carries: it is a part of the arm, and none of it is in the workspace.
struct CarriedObject {
  std::uint16_t id = 0;
  std::string arm;                                             ///< its name in the cell file
  std::string frame;                                           ///< the arm's link that holds it
  geometry::Pose X_FO;                                         ///< object frame in that link's frame
  std::uint64_t mesh_hash = 0;                                 ///< mesh_chunk's key
  double mass_kg = 0.0;                                        ///< 0: unknown
  Eigen::Vector3d centre_of_mass_m = Eigen::Vector3d::Zero();  ///< in the object's frame
  Eigen::Vector3d moments_kg_m2 = Eigen::Vector3d::Zero();     ///< inertia xx, yy, zz about that centre
  Eigen::Vector3d products_kg_m2 = Eigen::Vector3d::Zero();    ///< and xy, xz, yz
};
/// Greatest number of objects that the arms of a cell carry at a time.
inline constexpr std::size_t kMaxCarried = 16;

/// Topic workspace_version: commits the bricks of a whole version, and what arms carry in it.
struct WorkspaceVersion {
  std::string cell;
  workspace::VersionDescription description;
  std::vector<CarriedObject> carried = {};  ///< each object once
};

/// Topic workspace_brick: the newest state of one brick.
struct WorkspaceBrick {
  workspace::BrickKey key;
  std::uint64_t version = 0;  ///< the version that last changed it
  /// As workspace::encode_brick makes it; empty: the brick does not exist any more. Of a received brick it
  /// points into the message.
  std::span<const std::uint8_t> voxels_zstd;
};

/// Topic workspace_command: a request to add, move or remove one object while the workspace is served, or to
/// make it a part of an arm for a while.
struct WorkspaceCommand {
  core::SampleId stamp;   ///< identifies the command, also when it is sent again
  std::string requester;  ///< for the log
  WorkspaceOperation operation = WorkspaceOperation::kMove;
  std::string object;                           ///< all but add: its name; empty: `id` names it
  std::uint16_t id = 0;                         ///< all but add: its id, if the name is empty
  geometry::Pose X_WO;                          ///< move, and release with `sets_pose`: its new pose
  std::optional<std::uint16_t> guard_vox = {};  ///< move, release: thickness of its guard; none: unchanged
  std::string description = {};                 ///< add: its YAML, as in a cell file's `objects`
  std::string arm =
      {};  ///< attach: who takes it; release: who must carry it; empty: the server's, whoever does
  std::string frame = {};    ///< attach: the arm's link that holds it; empty: the last one
  bool sets_pose = false;    ///< attach, release: X_FO, X_WO apply; otherwise the arm's newest state decides
  geometry::Pose X_FO = {};  ///< attach with `sets_pose`: its pose in the frame of the link
};

}  // namespace phantom::messages

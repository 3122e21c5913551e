#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/geometry/mesh_io.hpp"
#include "common/layers/live_workspace.hpp"
#include "common/runtime/cell_bodies.hpp"
#include "components/wva_server/cell_changes.hpp"

namespace phantom::wva_server {

/// A command that changes the cell while it is served: adds, moves or removes one object.
enum class Operation { kAdd, kMove, kRemove };
struct CellCommand {
  Operation operation = Operation::kMove;
  std::string object;                 ///< move, remove: the object's name; empty: `id` names the object
  std::uint16_t id = 0;               ///< move, remove: the object's id, where the name is empty
  geometry::Pose X_WO;                ///< move: the object's new pose
  std::string description;            ///< add: the object in YAML, as in a cell file's `objects`
  std::optional<int> guard_vox = {};  ///< move: new guard skin, 0 … 100 voxels; none: unchanged
};
const char* name_of(Operation operation);

/// An object as it is served: what viewers show and what reports say about it.
struct ServedObject {
  std::uint16_t id = 0;
  runtime::ObjectConfig config;   ///< with its present pose
  geometry::TriangleMesh mesh_O;  ///< object frame, metres
  std::uint64_t mesh_hash = 0;
  std::vector<std::string> notes;  ///< assumptions made about its mesh
  layers::BodyReport report;
};

/// The effect of a command.
struct CellChange {
  std::uint16_t id = 0;
  std::string name;
  std::string said;  ///< the change in words, for the requester and the log
  layers::WorkspaceChange workspace;
};

/// Limits for objects that commands add.
struct AddLimits {
  geometry::MeshImportOptions mesh;
  std::uint64_t voxel_bytes = UINT64_MAX;  ///< above this size of all voxels in memory no object is added
};

/// Holds the cell that is served: the objects of the cell file, changed by commands that add, move and remove
/// objects. An object's id is never given to another object. Touches files and child processes only to read
/// the mesh of an added object. One thread; not real-time safe.
class LiveCell {
 public:
  /// `changes`: the changes that `cell` already contains.
  LiveCell(const runtime::CellConfig& cell, const AddLimits& limits, CellChanges changes);
  /// Starts with the cell as its file has it, without changes.
  LiveCell(const runtime::CellConfig& cell, const AddLimits& limits)
      : LiveCell(cell, limits, no_changes(cell)) {}

  /// Called after each activated object; `done` objects are activated by then.
  using OnObject = std::function<void(const ServedObject& object, std::size_t done)>;
  /// Activates the cell's objects, all or none, as the first version. `bodies`: from load_bodies().
  core::Expected<layers::WorkspaceChange> activate(std::vector<runtime::CellBody> bodies,
                                                   std::uint64_t version,
                                                   const layers::ActivationOptions& options,
                                                   const OnObject& on_object);
  /// Carries out a command. Otherwise returns why not and what is allowed, and leaves everything unchanged.
  core::Expected<CellChange> apply(const CellCommand& command, std::uint64_t version,
                                   const layers::ActivationOptions& options);

  /// Returns the cell as it was when it was activated.
  const runtime::CellConfig& cell() const { return cell_; }
  /// Returns how the cell now differs from its file.
  const CellChanges& changes() const { return changes_; }
  const std::map<std::uint16_t, ServedObject>& objects() const { return objects_; }
  const workspace::Workspace& workspace() const { return live_.workspace(); }
  std::uint64_t content_hash() const { return live_.content_hash(); }
  /// Moves the workspace out, for a caller that makes no more changes.
  workspace::Workspace take_workspace() && { return std::move(live_).take(); }

 private:
  core::Expected<std::uint16_t> find(const CellCommand& command) const;
  void check_memory() const;
  CellChange add(const CellCommand& command, std::uint64_t version, const layers::ActivationOptions& options);
  CellChange move(const CellCommand& command, std::uint64_t version,
                  const layers::ActivationOptions& options);
  CellChange remove(const CellCommand& command, std::uint64_t version,
                    const layers::ActivationOptions& options);

  runtime::CellConfig cell_;
  AddLimits limits_;
  layers::LiveWorkspace live_;
  std::map<std::uint16_t, ServedObject> objects_;
  CellChanges changes_;
};

/// Returns one line for the log: what the object's activation found.
std::string describe(const ServedObject& object);

}  // namespace phantom::wva_server

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

/// A command that changes the cell while it is served.
enum class Operation { kAdd, kMove, kRemove };
struct CellCommand {
  Operation operation = Operation::kMove;
  std::string object;                 ///< move, remove: its name; empty: named by id
  std::uint16_t id = 0;               ///< move, remove: its id, if the name is empty
  geometry::Pose X_WO;                ///< move: where it stands now
  std::string description;            ///< add: YAML, as an entry of a cell file's objects
  std::optional<int> guard_vox = {};  ///< move: its guard skin from now on, 0 … 100 voxels; none: as before
};
const char* name_of(Operation operation);

/// An object as it is served: what viewers show and reports tell.
struct ServedObject {
  std::uint16_t id = 0;
  runtime::ObjectConfig config;   ///< its pose is where it stands now
  geometry::TriangleMesh mesh_O;  ///< object frame, metres
  std::uint64_t mesh_hash = 0;
  std::vector<std::string> notes;  ///< what had to be assumed about its mesh
  layers::BodyReport report;
};

/// What a command did.
struct CellChange {
  std::uint16_t id = 0;
  std::string name;
  std::string said;  ///< in words, for who asked and for the log
  layers::WorkspaceChange workspace;
};

/// Limits for objects that commands add.
struct AddLimits {
  geometry::MeshImportOptions mesh;
  std::uint64_t voxel_bytes = UINT64_MAX;  ///< none is added once the voxels in memory take more than this
};

/// The cell as it is served: the objects of the cell file, then as commands add, move and remove them. An id
/// that was given away is not given to another object. Touches files and child processes only to read the
/// mesh of an object that is added. One thread; not real-time safe.
class LiveCell {
 public:
  /// `changes`: those that `cell` has already.
  LiveCell(const runtime::CellConfig& cell, const AddLimits& limits, CellChanges changes);
  /// A cell as its file has it.
  LiveCell(const runtime::CellConfig& cell, const AddLimits& limits)
      : LiveCell(cell, limits, no_changes(cell)) {}

  /// Called after each object with how many are done.
  using OnObject = std::function<void(const ServedObject& object, std::size_t done)>;
  /// Activates the cell's objects, all or none: the first version. `bodies`: as load_bodies() gives them.
  core::Expected<layers::WorkspaceChange> activate(std::vector<runtime::CellBody> bodies,
                                                   std::uint64_t version,
                                                   const layers::ActivationOptions& options,
                                                   const OnObject& on_object);
  /// Carries out a command, or says why not and what is allowed, with everything as before.
  core::Expected<CellChange> apply(const CellCommand& command, std::uint64_t version,
                                   const layers::ActivationOptions& options);

  /// The cell as it was when it was activated.
  const runtime::CellConfig& cell() const { return cell_; }
  /// How the cell differs now from its file.
  const CellChanges& changes() const { return changes_; }
  const std::map<std::uint16_t, ServedObject>& objects() const { return objects_; }
  const workspace::Workspace& workspace() const { return live_.workspace(); }
  std::uint64_t content_hash() const { return live_.content_hash(); }
  /// The workspace alone, for who wants no more changes.
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

/// One line for the log: what an object's activation found.
std::string describe(const ServedObject& object);

}  // namespace phantom::wva_server

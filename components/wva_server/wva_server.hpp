#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/geometry/mesh/mesh_io.hpp"
#include "common/geometry/mesh/solid_moments.hpp"
#include "common/layers/live_workspace.hpp"
#include "common/messages/workspace.hpp"
#include "common/runtime/cell/cell_bodies.hpp"
#include "components/wva_server/cell_changes.hpp"
#include "components/wva_server/live/live_matter.hpp"

namespace phantom::wva_server {

using messages::WorkspaceCommand;
using messages::WorkspaceOperation;
const char* name_of(WorkspaceOperation operation);

/// An object as it is served: what viewers show and what reports say about it.
struct ServedObject {
  std::uint16_t id = 0;
  runtime::ObjectConfig config;         ///< with its present pose; of a carried one: before it was attached
  std::optional<Carrier> carrier = {};  ///< who carries it; none: it stands in the workspace
  double guard_m = 0.0;                 ///< thickness of its guard
  geometry::TriangleMesh mesh_O;        ///< object frame, metres
  std::uint64_t mesh_hash = 0;
  geometry::SolidMoments moments = {};
  std::vector<std::string> notes;  ///< assumptions made about its mesh
  layers::BodyReport report;
};

/// The effect of a command.
struct CellChange {
  std::uint16_t id = 0;
  std::string name;
  std::string message;  ///< the change in words, for the requester and the log
  layers::WorkspaceChange workspace;
};

/// Limits for commands.
struct AddLimits {
  geometry::MeshImportOptions mesh;
  std::uint64_t voxel_bytes = UINT64_MAX;  ///< above this size of all voxels in memory no object is added
  std::uint64_t mesh_bytes = UINT64_MAX;   ///< above this size of all meshes ever served none is added
  /// Greatest work of a command, moves included, in steps of a formula (core::WorkBudget).
  std::uint64_t steps = UINT64_MAX;
  std::size_t objects = SIZE_MAX;  ///< as soon as there are so many none is added
};

/// Holds the cell that is served: the objects of the cell file, changed by commands that add, move and remove
/// objects, or let an arm carry them. It alone decides where an object is: in the workspace, or carried by
/// one arm, from one version on. An object's id is given to another one only once all ids were given. Touches
/// files and child processes only to read the mesh of an added object. One thread; not real-time safe.
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
  /// The work is bounded by AddLimits. options.keep_going is called on several threads; once it returns
  /// false, the command ends soon with kUnavailable. An attach must name arm, frame and pose, a release the
  /// pose (Carriers::complete).
  core::Expected<CellChange> apply(const WorkspaceCommand& command, std::uint64_t version,
                                   const layers::ActivationOptions& options);

  /// Makes room for live matter: its profile's μ get codes, and its ids and names are given to nothing else.
  /// Call it once, after activate().
  core::Expected<layers::WorkspaceChange> begin_live(const workspace::LayerProfile& profile,
                                                     std::uint64_t version);
  /// Gives live matter and its objects their voxels (layers::LiveWorkspace::put).
  core::Expected<layers::WorkspaceChange> put_live(std::vector<layers::ComputedObject> objects,
                                                   std::uint64_t version, int threads);
  /// Returns the voxels that the model's objects in the workspace fill.
  workspace::BitVolume solid() const {
    return live_.solid([](std::uint16_t id) { return !messages::is_live(id); });
  }
  /// Returns whether an object of the model has this name.
  bool has(const std::string& name) const;

  /// Gives the next object that is added this id, if it is free.
  void prefer_id(std::uint16_t id) { changes_.next_id = id; }
  /// Returns the object that a command other than add is about, or why there is none.
  core::Expected<std::uint16_t> find(const WorkspaceCommand& command) const;
  /// Returns what arms carry in the present version.
  std::vector<messages::CarriedObject> carried() const;
  /// Returns the name of the object that a command is about; empty if it has none that can be read.
  std::string name_in(const WorkspaceCommand& command) const;
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
  void check_room() const;
  std::uint16_t free_id() const;
  void note_mesh(const ServedObject& object);
  void set_guard(ServedObject& object, const workspace::LayerProfile& profile, bool by_command) const;
  runtime::ObjectConfig placed(const ServedObject& object, const WorkspaceCommand& command) const;
  CellChange add(const WorkspaceCommand& command, std::uint64_t version,
                 const layers::ActivationOptions& options);
  CellChange move(const WorkspaceCommand& command, std::uint64_t version,
                  const layers::ActivationOptions& options);
  CellChange remove(const WorkspaceCommand& command, std::uint64_t version,
                    const layers::ActivationOptions& options);
  CellChange attach(const WorkspaceCommand& command, std::uint64_t version,
                    const layers::ActivationOptions& options);
  CellChange release(const WorkspaceCommand& command, std::uint64_t version,
                     const layers::ActivationOptions& options);

  runtime::CellConfig cell_;
  AddLimits limits_;
  layers::LiveWorkspace live_;
  std::map<std::uint16_t, ServedObject> objects_;
  std::set<std::uint64_t> meshes_;  // hashes of all meshes that were ever served: they stay published
  std::uint64_t mesh_bytes_ = 0;    // of these
  CellChanges changes_;
  bool has_live_ = false;  // live matter has its id
};

/// Returns one line for the log: what the object's activation found.
std::string describe(const ServedObject& object);

}  // namespace phantom::wva_server

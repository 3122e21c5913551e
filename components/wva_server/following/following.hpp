#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>

#include "components/wva_server/wva_server.hpp"

namespace phantom::wva_server {

/// An object as the leader has it: another server of the same cell, in voxels of another size.
struct LeaderObject {
  messages::WorkspaceObject object;                     ///< removed() once the leader removed it
  double pose_error_m = -1.0;                           ///< as ObjectUncertainty has it; −1: not stated
  std::optional<messages::CarriedObject> carried = {};  ///< by an arm
};
using LeaderObjects = std::map<std::uint16_t, LeaderObject>;  ///< by id

/// Makes a cell follow the leader's objects: where each stands, its guard, which are removed, added, and
/// carried by arms. It compares states, so that neither a lost command nor a restart of either server
/// matters. Objects that the leader never had stay as they are. Pure; one thread.
class Following {
 public:
  /// Returns a mesh by its hash; null: it is not known yet.
  using MeshOf = std::function<const geometry::TriangleMesh*(std::uint64_t)>;

  /// Returns the next command that makes the cell more like the leader's; none if nothing differs, or only
  /// what the cell refused.
  std::optional<WorkspaceCommand> next(const LeaderObjects& leader, const LiveCell& cell,
                                       const MeshOf& mesh_of);
  /// Reports that the cell refused the last command. It is not given again until the leader's object changes.
  void refused(const std::string& why);
  /// Returns what does not follow, in words; empty: all does.
  std::string faults() const;
  /// Returns whether a command is one of these.
  static bool is_own(const WorkspaceCommand& command);

 private:
  struct Refusal {
    LeaderObject of;
    std::string why;
  };
  bool is_settled(std::uint16_t id, const LeaderObject& object);

  std::uint16_t last_id_ = 0;  // of the object that the last command is about
  LeaderObject last_;          // as it was then
  std::map<std::uint16_t, Refusal> refusals_;
};

}  // namespace phantom::wva_server

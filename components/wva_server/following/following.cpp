#include "components/wva_server/following/following.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>

#include "common/core/text.hpp"
#include "common/runtime/configuration/pose_text.hpp"

namespace phantom::wva_server {
namespace {

constexpr double kSamePose =
    1e-6;  // m, and of the rotations' entries: poses of two cell files differ by rounding
constexpr double kSameError_m = 1e-9;
constexpr int kMaxGuard_vox = 100;
constexpr const char* kRequester = "the server that this one follows";

bool alike(const geometry::Pose& a, const geometry::Pose& b) {
  return (a.translation_m - b.translation_m).norm() < kSamePose &&
         (a.rotation - b.rotation).cwiseAbs().maxCoeff() < kSamePose;
}

/// Whether one carries the object as the other does: CarriedObject, Carrier.
template <class One, class Other>
bool alike(const One& a, const Other& b) {
  return a.arm == b.arm && a.frame == b.frame && alike(a.X_FO, b.X_FO);
}

bool alike(const LeaderObject& a, const LeaderObject& b) {
  return a.object.mesh_hash == b.object.mesh_hash && a.object.name == b.object.name &&
         alike(a.object.X_WO, b.object.X_WO) && std::abs(a.pose_error_m - b.pose_error_m) < kSameError_m &&
         a.carried.has_value() == b.carried.has_value() && (!a.carried || alike(*a.carried, *b.carried));
}

/// Returns the guard, in the cell's voxels, that covers the leader's stated error of a pose; none if the
/// object has it, or if none is stated.
std::optional<std::uint16_t> wanted_guard(const LeaderObject& leader, const ServedObject& own,
                                          double voxel_m) {
  if (!(leader.pose_error_m > 0.0)) return std::nullopt;
  const double has_m = own.config.pose_error_m;
  if (has_m > leader.pose_error_m - kSameError_m && has_m < leader.pose_error_m + voxel_m - kSameError_m)
    return std::nullopt;
  const double voxels = std::ceil((leader.pose_error_m - kSameError_m) / voxel_m);
  const auto guard = static_cast<std::uint16_t>(std::min<double>(voxels, kMaxGuard_vox));
  if (guard == kMaxGuard_vox && own.config.profile.guard_vox == kMaxGuard_vox) return std::nullopt;
  return guard;
}

/// Returns the object in words of a cell file.
std::string description_of(const LeaderObject& leader, const geometry::TriangleMesh& mesh_O) {
  nlohmann::json vertices = nlohmann::json::array(), triangles = nlohmann::json::array();
  for (const Eigen::Vector3f& v : mesh_O.vertices_m)
    for (int axis = 0; axis < 3; ++axis) vertices.push_back(v[axis]);
  for (const auto& t : mesh_O.triangles)
    for (const std::uint32_t corner : t) triangles.push_back(corner);
  std::istringstream words(runtime::pose_text(leader.object.X_WO));  // rounded; a move corrects it
  std::array<double, 6> pose{};
  for (double& number : pose) words >> number;
  return nlohmann::json{
      {"name", leader.object.name},
      {"polyhedron", {{"vertices_m", vertices}, {"triangles", triangles}}},
      {"pose", {{"xyz_m", {pose[0], pose[1], pose[2]}}, {"rpy_deg", {pose[3], pose[4], pose[5]}}}},
      {"colour", leader.object.colour}}
      .dump();
}

WorkspaceCommand command_for(WorkspaceOperation operation, std::uint16_t id) {
  WorkspaceCommand command;
  command.requester = kRequester;
  command.operation = operation;
  command.id = id;
  return command;
}

std::optional<WorkspaceCommand> add_command(const LeaderObject& leader, const Following::MeshOf& mesh_of) {
  const geometry::TriangleMesh* mesh_O = mesh_of(leader.object.mesh_hash);
  if (mesh_O == nullptr) return std::nullopt;
  WorkspaceCommand command = command_for(WorkspaceOperation::kAdd, leader.object.id);
  command.description = description_of(leader, *mesh_O);
  return command;
}

/// Returns the command that brings an object where the leader has it; none if it is there.
std::optional<WorkspaceCommand> place_command(const LeaderObject& leader, const ServedObject& own,
                                              double voxel_m) {
  if (leader.carried && own.carrier) {
    if (alike(*leader.carried, *own.carrier)) return std::nullopt;
    WorkspaceCommand command = command_for(WorkspaceOperation::kRelease, own.id);  // to be attached as there
    command.sets_pose = true;
    command.X_WO = leader.object.X_WO;
    return command;
  }
  if (leader.carried) {
    WorkspaceCommand command = command_for(WorkspaceOperation::kAttach, own.id);
    command.arm = leader.carried->arm;
    command.frame = leader.carried->frame;
    command.sets_pose = true;
    command.X_FO = leader.carried->X_FO;
    return command;
  }
  const auto guard = wanted_guard(leader, own, voxel_m);
  if (!own.carrier && alike(leader.object.X_WO, own.config.X_WO) && !guard) return std::nullopt;
  WorkspaceCommand command =
      command_for(own.carrier ? WorkspaceOperation::kRelease : WorkspaceOperation::kMove, own.id);
  command.sets_pose = own.carrier.has_value();
  command.X_WO = leader.object.X_WO;
  command.guard_vox = guard;
  return command;
}

}  // namespace

bool Following::is_own(const WorkspaceCommand& command) { return command.requester == kRequester; }

/// Returns whether the cell refused to follow the object as it is now.
bool Following::is_settled(std::uint16_t id, const LeaderObject& object) {
  const auto refusal = refusals_.find(id);
  if (refusal == refusals_.end()) return false;
  if (alike(refusal->second.of, object)) return true;
  refusals_.erase(refusal);
  return false;
}

std::optional<WorkspaceCommand> Following::next(const LeaderObjects& leader, const LiveCell& cell,
                                                const MeshOf& mesh_of) {
  const double voxel_m = cell.cell().voxel_size_m.reference_m();
  for (const auto& [id, object] : leader) {
    if (messages::is_live(id) || is_settled(id, object)) continue;
    const auto own = cell.objects().find(id);
    const bool is_here = own != cell.objects().end();
    std::optional<WorkspaceCommand> command;
    if (object.object.removed()) {
      if (is_here) command = command_for(WorkspaceOperation::kRemove, id);
    } else if (!is_here) {
      command = add_command(object, mesh_of);
    } else {
      command = place_command(object, own->second, voxel_m);
    }
    if (!command) continue;
    last_id_ = id;
    last_ = object;
    return command;
  }
  return std::nullopt;
}

void Following::refused(const std::string& why) { refusals_[last_id_] = {last_, why}; }

std::string Following::faults() const {
  return core::listed(refusals_, [](const auto& refusal) {
    const messages::WorkspaceObject& object = refusal.second.of.object;
    return fmt::format("{} ({})",
                       object.name.empty() ? "object " + std::to_string(refusal.first) : object.name,
                       refusal.second.why);
  });
}

}  // namespace phantom::wva_server

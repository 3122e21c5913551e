#include "common/messages/codecs/workspace_codec.hpp"

#include <set>

#include "common/messages/codecs/fields_codec.hpp"

namespace phantom::messages {
namespace {

constexpr double kMaxId = 65534.0, kThickestGuard_vox = 100.0;
constexpr double kMaxChunks = 4096.0, kMaxMeshParts = 2e7;
constexpr std::size_t kMaxChunkBytes = 256 * 1024;

constexpr double kMaxMass_kg = 1e5, kMaxInertia_kg_m2 = 1e9;

constexpr auto kCarriedObject = [](auto& codec, auto& m, auto& s) {
  codec.number("carried.id", m.id(), s.id, 1.0, kMaxId);
  codec.any(m.arm(), s.arm);
  codec.any(m.frame(), s.frame);
  codec.pose("carried.X_FO", m.X_FO(), s.X_FO);
  codec.any(m.mesh_hash(), s.mesh_hash);
  codec.number("carried.mass_kg", m.mass_kg(), s.mass_kg, 0.0, kMaxMass_kg);
  codec.place("carried.centre_of_mass_m", m.centre_of_mass_m(), s.centre_of_mass_m);
  codec.vector("carried.moments_kg_m2", m.moments_kg_m2(), s.moments_kg_m2, kMaxInertia_kg_m2);
  codec.vector("carried.products_kg_m2", m.products_kg_m2(), s.products_kg_m2, kMaxInertia_kg_m2);
};

void take_sides(Decoder& codec, const msg::Vector3& from, workspace::VoxelSize& to) {
  Eigen::Vector3d sides_m;
  codec.vector("voxel_size_m", from, sides_m, kFarthest_m);
  to = workspace::VoxelSize(sides_m);
}
void take_sides(Encoder& codec, msg::Vector3& to, const workspace::VoxelSize& from) {
  codec.vector("voxel_size_m", to, from.sides_m(), kFarthest_m);
}

constexpr auto kWorkspaceVersion = [](auto& codec, auto& m, auto& s) {
  auto& to = s.description;
  codec.any(m.cell(), s.cell);
  codec.number("version", m.version(), to.version, 1.0);
  codec.place("origin_m", m.origin_m(), to.grid.origin_m);
  take_sides(codec, m.voxel_size_m(), to.grid.voxel_size_m);
  codec.number("size_x_vox", m.size_x_vox(), to.grid.size_vox[0]);
  codec.number("size_y_vox", m.size_y_vox(), to.grid.size_vox[1]);
  codec.number("size_z_vox", m.size_z_vox(), to.grid.size_vox[2]);
  codec.any(m.palette(), to.palette_Pa_s_per_m);
  codec.any(m.brick_count(), to.brick_count);
  codec.any(m.content_hash(), to.content_hash);
  codec.list(m.carried(), s.carried, kCarriedObject, kMaxCarried);
};

constexpr auto kWorkspaceBrick = [](auto& codec, auto& m, auto& s) {
  constexpr double kLast = workspace::kMaxBricks - 1;
  codec.number("bx", m.bx(), s.key.x, 0.0, kLast);
  codec.number("by", m.by(), s.key.y, 0.0, kLast);
  codec.number("bz", m.bz(), s.key.z, 0.0, kLast);
  codec.any(m.version(), s.version);
  codec.octets(m.voxels_zstd(), s.voxels_zstd);
};

constexpr auto kWorkspaceObject = [](auto& codec, auto& m, auto& s) {
  codec.number("id", m.id(), s.id, 1.0, kMaxId);
  codec.any(m.mesh_hash(), s.mesh_hash);
  if (s.removed()) return;
  codec.any(m.name(), s.name);
  codec.pose("X_WO", m.X_WO(), s.X_WO);
  codec.number("red", m.red(), s.colour[0], 0.0, 1.0);
  codec.number("green", m.green(), s.colour[1], 0.0, 1.0);
  codec.number("blue", m.blue(), s.colour[2], 0.0, 1.0);
};

constexpr auto kMeshChunk = [](auto& codec, auto& m, auto& s) {
  codec.any(m.mesh_hash(), s.mesh_hash);
  codec.number("chunk_count", m.chunk_count(), s.chunk_count, 1.0, kMaxChunks);
  codec.number("chunk", m.chunk(), s.chunk, 0.0, s.chunk_count - 1.0);
  codec.number("vertex_count", m.vertex_count(), s.vertex_count, 1.0, kMaxMeshParts);
  codec.number("triangle_count", m.triangle_count(), s.triangle_count, 1.0, kMaxMeshParts);
  codec.any(m.data(), s.data);
};

/// Returns whether the command says where in W the object is to stand.
bool sets_place(const WorkspaceCommand& command) {
  return command.operation == WorkspaceOperation::kMove ||
         (command.operation == WorkspaceOperation::kRelease && command.sets_pose);
}

constexpr auto kWorkspaceCommand = [](auto& codec, auto& m, auto& s) {
  codec.stamp(m.stamp(), s.stamp);
  codec.any(m.requester(), s.requester);
  codec.enumeration("operation", m.operation(), s.operation, WorkspaceOperation::kRelease);
  codec.name("object", m.object(), s.object);
  codec.number("id", m.id(), s.id, 0.0, kMaxId);
  codec.whole_text("description", m.description(), s.description);
  codec.name("arm", m.arm(), s.arm);
  codec.name("frame", m.frame(), s.frame);
  codec.any(m.sets_pose(), s.sets_pose);
  if (sets_place(s)) codec.pose("X_WO", m.X_WO(), s.X_WO);
  if (s.operation == WorkspaceOperation::kAttach && s.sets_pose) codec.pose("X_FO", m.X_FO(), s.X_FO);
};

constexpr auto kWorkspaceReply = [](auto& codec, auto& m, auto& s) {
  codec.stamp(m.stamp(), s.stamp);
  codec.echo(m.command(), s.command);
  codec.any(m.requester(), s.requester);
  codec.enumeration("operation", m.operation(), s.operation, WorkspaceOperation::kRelease);
  codec.any(m.object(), s.object);
  codec.any(m.id(), s.id);
  codec.enumeration("outcome", m.outcome(), s.outcome, WorkspaceOutcome::kRefused);
  codec.any(m.message(), s.message);
  codec.any(m.version(), s.version);
  codec.any(m.changed_bricks(), s.changed_bricks);
  codec.any(m.removed_bricks(), s.removed_bricks);
  codec.number("seconds", m.seconds(), s.seconds, 0.0);
};

/// Returns why the command's fields do not fit together; empty if they do.
std::string refusal(const WorkspaceCommand& command) {
  if (command.operation == WorkspaceOperation::kAdd)
    return command.description.empty() ? "description is empty; allowed: an object as in a cell file" : "";
  if (command.object.empty() && command.id == 0)
    return "object is empty and id is 0; allowed: a name, or an id of 1 to 65534";
  return "";
}

}  // namespace

core::Status read(const msg::WorkspaceCommand& message, WorkspaceCommand& command) {
  const auto fields = [](auto& codec, auto& m, auto& s) {
    kWorkspaceCommand(codec, m, s);
    const bool may_set_guard =
        s.operation == WorkspaceOperation::kMove || s.operation == WorkspaceOperation::kRelease;
    if (!may_set_guard || !m.sets_guard()) return;
    codec.number("guard_vox", m.guard_vox(), s.guard_vox.emplace(), 0.0, kThickestGuard_vox);
  };
  const core::Status status = decode(fields, message, {}, command);
  if (!status) return status;
  const std::string why = refusal(command);
  return why.empty() ? core::Status::ok() : core::Status::invalid_argument(why);
}

core::Expected<WorkspaceVersion> from_idl(const msg::WorkspaceVersion& message, const ArmBounds& arm) {
  auto version = decoded<WorkspaceVersion>(kWorkspaceVersion, message, arm);
  if (!version) return version;
  std::set<std::uint16_t> carried;
  for (const CarriedObject& object : version->carried) {
    if (!carried.insert(object.id).second)
      return core::Status::invalid_argument("object " + std::to_string(object.id) +
                                            " is carried twice; allowed: each once");
    if (object.moments_kg_m2.minCoeff() < 0.0)
      return core::Status::invalid_argument("carried.moments_kg_m2 is below 0; allowed: 0 or more");
  }
  if (core::Status status = workspace::check(version->description); !status) return status;
  return version;
}
core::Expected<WorkspaceBrick> from_idl(const msg::WorkspaceBrick& message, const ArmBounds& arm) {
  return decoded<WorkspaceBrick>(kWorkspaceBrick, message, arm);
}
core::Expected<WorkspaceObject> from_idl(const msg::WorkspaceObject& message, const ArmBounds& arm) {
  return decoded<WorkspaceObject>(kWorkspaceObject, message, arm);
}
core::Expected<MeshChunk> from_idl(const msg::MeshChunk& message, const ArmBounds& arm) {
  auto chunk = decoded<MeshChunk>(kMeshChunk, message, arm);
  if (chunk && (chunk->data.empty() || chunk->data.size() > kMaxChunkBytes))
    return core::Status::invalid_argument("data has " + std::to_string(chunk->data.size()) +
                                          " bytes; allowed: 1 to " + std::to_string(kMaxChunkBytes));
  return chunk;
}
core::Expected<WorkspaceCommand> from_idl(const msg::WorkspaceCommand& message, const ArmBounds&) {
  return read_whole<WorkspaceCommand>(message);
}
core::Expected<WorkspaceReply> from_idl(const msg::WorkspaceReply& message, const ArmBounds& arm) {
  return decoded<WorkspaceReply>(kWorkspaceReply, message, arm);
}

msg::WorkspaceVersion to_idl(const WorkspaceVersion& version) {
  return encoded<msg::WorkspaceVersion>(kWorkspaceVersion, version);
}
msg::WorkspaceBrick to_idl(const WorkspaceBrick& brick) {
  return encoded<msg::WorkspaceBrick>(kWorkspaceBrick, brick);
}
msg::WorkspaceObject to_idl(const WorkspaceObject& object) {
  return encoded<msg::WorkspaceObject>(kWorkspaceObject, object);
}
msg::MeshChunk to_idl(const MeshChunk& chunk) { return encoded<msg::MeshChunk>(kMeshChunk, chunk); }
msg::WorkspaceCommand to_idl(const WorkspaceCommand& command) {
  auto message = encoded<msg::WorkspaceCommand>(kWorkspaceCommand, command);
  message.sets_guard(command.guard_vox.has_value());
  message.guard_vox(command.guard_vox.value_or(0));
  return message;
}
msg::WorkspaceReply to_idl(const WorkspaceReply& reply) {
  return encoded<msg::WorkspaceReply>(kWorkspaceReply, reply);
}

}  // namespace phantom::messages

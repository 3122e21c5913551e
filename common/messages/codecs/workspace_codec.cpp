#include "common/messages/codecs/workspace_codec.hpp"

#include <set>
#include <unordered_set>

#include "common/messages/codecs/fields_codec.hpp"

namespace phantom::messages {
namespace {

bool is_there(const WorkspaceObject& object) { return !object.removed(); }
/// Returns whether the command says where in W the object is to stand.
bool sets_place(const WorkspaceCommand& command) {
  return command.operation == WorkspaceOperation::kMove ||
         (command.operation == WorkspaceOperation::kRelease && command.sets_pose);
}
/// Returns whether the command says where in the arm's hand the object is to be.
bool sets_hold(const WorkspaceCommand& command) {
  return command.operation == WorkspaceOperation::kAttach && command.sets_pose;
}

#include "phantom_contract/workspace_fields.inc"

// Each returns why a sample's fields do not fit together; empty if they do.

std::string refusal(const WorkspaceVersion& version) {
  std::set<std::uint16_t> carried;
  for (const CarriedObject& object : version.carried) {
    if (!carried.insert(object.id).second)
      return "object " + std::to_string(object.id) + " is carried twice; allowed: each once";
    if (object.moments_kg_m2.minCoeff() < 0.0) return "carried.moments_kg_m2 is below 0; allowed: 0 or more";
  }
  return workspace::check(version.description).message();
}

std::string refusal(const MeshChunk& chunk) {
  if (chunk.chunk < chunk.chunk_count) return "";
  return "chunk is " + std::to_string(chunk.chunk) + "; allowed: 0 to " +
         std::to_string(chunk.chunk_count - 1);
}

// A block's voxels beyond the grid must be free.
std::string refusal(const OccupancyChange& change) {
  std::unordered_set<std::uint64_t> known;
  known.reserve(change.blocks.size());
  const auto& size = change.grid.size_vox;
  for (const OccupancyBlock& block : change.blocks) {
    const std::uint64_t place =
        std::uint64_t{block.x} << 32 | std::uint64_t{block.y} << 16 | std::uint64_t{block.z};
    const auto name = [&] {
      return "block (" + std::to_string(block.x) + ", " + std::to_string(block.y) + ", " +
             std::to_string(block.z) + ")";
    };
    if (!known.insert(place).second) return name() + " comes twice; allowed: each once";
    if (8 * block.x >= size[0] || 8 * block.y >= size[1] || 8 * block.z >= size[2])
      return name() + " is not in the grid; allowed: those that have a voxel of it";
    for (std::int32_t z = 0; z < 8; ++z) {
      for (std::int32_t y = 0; y < 8; ++y) {
        const auto row = static_cast<unsigned>(block.bits[static_cast<std::size_t>(z)] >> (8 * y) & 0xFF);
        if (row == 0) continue;
        const std::int32_t columns = size[0] - 8 * block.x;
        if (8 * block.z + z >= size[2] || 8 * block.y + y >= size[1] || (columns < 8 && row >> columns != 0))
          return name() + " has occupied voxels beyond the grid; allowed: none there";
      }
    }
  }
  return "";
}

std::string refusal(const SpaceView& view) {
  const std::size_t cubes = std::size_t{view.size_x} * view.size_y * view.size_z;
  if (cubes == view.ages.size()) return "";
  return "ages has " + std::to_string(view.ages.size()) + " values; allowed: one for each of the " +
         std::to_string(cubes) + " cubes";
}

std::string refusal(const WorkspaceCommand& command) {
  constexpr std::size_t kMaxNameBytes = 64;  // of an object
  if (command.operation == WorkspaceOperation::kAdd)
    return command.description.empty() ? "description is empty; allowed: an object as in a cell file" : "";
  if (command.object.empty() && command.id == 0)
    return "object is empty and id is 0; allowed: a name, or an id of 1 to 65534";
  if (command.operation == WorkspaceOperation::kName &&
      (command.description.empty() || command.description.size() > kMaxNameBytes))
    return "description has " + std::to_string(command.description.size()) +
           " bytes; allowed: a name of 1 to " + std::to_string(kMaxNameBytes);
  return "";
}

}  // namespace

core::Status read(const msg::WorkspaceCommand& message, WorkspaceCommand& command, const ArmBounds& arm) {
  const auto fields = [](auto& codec, auto& m, auto& s) {
    constexpr double kThickestGuard_vox = 100.0;
    kWorkspaceCommand(codec, m, s);
    const bool may_set_guard =
        s.operation == WorkspaceOperation::kMove || s.operation == WorkspaceOperation::kRelease;
    if (!may_set_guard || !m.sets_guard()) return;
    codec.number("guard_vox", m.guard_vox(), s.guard_vox.emplace(), 0.0, kThickestGuard_vox);
  };
  return judged(decode(fields, message, arm, command), command, [](const auto& s) { return refusal(s); });
}
msg::WorkspaceCommand to_idl(const WorkspaceCommand& command) {
  auto message = encoded<msg::WorkspaceCommand>(kWorkspaceCommand, command);
  message.sets_guard(command.guard_vox.has_value());
  message.guard_vox(command.guard_vox.value_or(0));
  return message;
}

#include "phantom_contract/workspace_codec.inc"

}  // namespace phantom::messages

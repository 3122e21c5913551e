#include "components/wva_server/dds_adapter_convert.hpp"

#include <spdlog/fmt/fmt.h>

namespace phantom::wva_server {
namespace {

constexpr std::size_t kNameBound = 64, kMessageBound = 1024, kDescriptionBound = 16384;  // bounds in the IDL

}  // namespace

msg::WorkspaceVersion version_message(const std::string& cell, const workspace::Workspace& workspace,
                                      std::uint64_t hash) {
  const workspace::GridSpec& grid = workspace.grid();
  msg::WorkspaceVersion message;
  message.cell(cell.substr(0, kNameBound));
  message.version(workspace.version);
  message.origin_m().x(grid.origin_m.x());
  message.origin_m().y(grid.origin_m.y());
  message.origin_m().z(grid.origin_m.z());
  message.voxel_size_m(grid.voxel_size_m);
  message.size_x_vox(static_cast<std::uint32_t>(grid.size_vox[0]));
  message.size_y_vox(static_cast<std::uint32_t>(grid.size_vox[1]));
  message.size_z_vox(static_cast<std::uint32_t>(grid.size_vox[2]));
  message.palette(workspace.palette());
  message.brick_count(static_cast<std::uint32_t>(workspace.brick_count()));
  message.content_hash(hash);
  return message;
}

std::string refusal(const msg::WorkspaceCommand& message) {
  const auto operation = static_cast<std::uint32_t>(message.operation());
  if (operation > static_cast<std::uint32_t>(msg::WORKSPACE_REMOVE))
    return fmt::format("operation is {}; allowed: 0 (add), 1 (move), 2 (remove)", operation);
  if (message.operation() == msg::WORKSPACE_ADD)
    return message.description().size() == 0 ? "description is empty; allowed: an object as in a cell file"
                                             : "";
  if (message.object().size() == 0 && (message.id() == 0 || message.id() == 65535))
    return fmt::format("object is empty and id is {}; allowed: a name, or an id of 1 to 65534", message.id());
  if (message.operation() != msg::WORKSPACE_MOVE) return "";
  if (message.sets_guard() && message.guard_vox() > 100)
    return fmt::format("guard_vox is {}; allowed: 0 to 100 voxels", message.guard_vox());
  return messages::pose_of("X_WO", message.X_WO()).status().message();
}

Request to_request(const msg::WorkspaceCommand& message) {
  Request request;
  request.id = dds::id_of(message.stamp());
  request.requester = message.requester().c_str();
  CellCommand& command = request.command;
  command.operation = static_cast<Operation>(message.operation());
  command.object = message.object().c_str();
  command.id = message.id();
  command.description = message.description().c_str();
  if (message.operation() != msg::WORKSPACE_MOVE) return request;
  if (const auto X_WO = messages::pose_of("X_WO", message.X_WO())) command.X_WO = *X_WO;
  if (message.sets_guard()) command.guard_vox = message.guard_vox();
  return request;
}

msg::WorkspaceCommand to_message(const CellCommand& command, const std::string& requester) {
  if (command.description.size() > kDescriptionBound) {
    throw core::ConfigError(fmt::format("the description has {} bytes; allowed: at most {}",
                                        command.description.size(), kDescriptionBound));
  }
  if (command.object.size() > kNameBound)
    throw core::ConfigError("object '" + command.object + "': allowed: a name of at most 64 bytes");
  msg::WorkspaceCommand message;
  message.requester(requester.substr(0, kNameBound));
  message.operation(static_cast<msg::WorkspaceOperation>(command.operation));
  message.object(command.object);
  message.id(command.id);
  message.X_WO(messages::to_idl(command.X_WO));
  message.sets_guard(command.guard_vox.has_value());
  message.guard_vox(static_cast<std::uint16_t>(command.guard_vox.value_or(0)));
  message.description(command.description);
  return message;
}

msg::WorkspaceReply to_message(const Request& request, const Reply& reply) {
  msg::WorkspaceReply message;
  message.requester(request.requester.substr(0, kNameBound));
  message.operation(static_cast<msg::WorkspaceOperation>(request.command.operation));
  message.object(reply.object.substr(0, kNameBound));
  message.id(reply.object_id);
  message.outcome(static_cast<msg::WorkspaceOutcome>(reply.outcome));
  message.message(reply.message.substr(0, kMessageBound));
  message.version(reply.version);
  message.changed_bricks(static_cast<std::uint32_t>(reply.changed_bricks));
  message.removed_bricks(static_cast<std::uint32_t>(reply.removed_bricks));
  message.seconds(reply.seconds);
  return message;
}

Reply to_reply(const msg::WorkspaceReply& message) {
  Reply reply;
  const auto outcome = static_cast<std::uint32_t>(message.outcome());
  reply.outcome = outcome <= static_cast<std::uint32_t>(msg::WORKSPACE_REFUSED)
                      ? static_cast<Outcome>(outcome)
                      : Outcome::kRefused;
  reply.message = message.message().c_str();
  reply.object = message.object().c_str();
  reply.object_id = message.id();
  reply.version = message.version();
  reply.changed_bricks = message.changed_bricks();
  reply.removed_bricks = message.removed_bricks();
  reply.seconds = message.seconds();
  return reply;
}

}  // namespace phantom::wva_server

#include "common/messages/workspace_codec.hpp"

#include "common/messages/fields_codec.hpp"

namespace phantom::messages {
namespace {

constexpr double kGreatestId = 65534.0;

constexpr auto kPose = [](auto& codec, auto& m, auto& s) { codec.pose("pose", m, s); };

constexpr auto kWorkspaceObject = [](auto& codec, auto& m, auto& s) {
  codec.number("id", m.id(), s.id, 1.0, kGreatestId);
  codec.any(m.mesh_hash(), s.mesh_hash);
  if (s.removed()) return;
  codec.any(m.name(), s.name);
  codec.pose("X_WO", m.X_WO(), s.X_WO);
  codec.number("red", m.red(), s.colour[0], 0.0, 1.0);
  codec.number("green", m.green(), s.colour[1], 0.0, 1.0);
  codec.number("blue", m.blue(), s.colour[2], 0.0, 1.0);
};

}  // namespace

core::Expected<WorkspaceObject> from_idl(const msg::WorkspaceObject& message, const ArmBounds& arm) {
  return decoded<WorkspaceObject>(kWorkspaceObject, message, arm);
}
core::Expected<geometry::Pose> pose_of(const char* field, const msg::Pose& message) {
  const auto fields = [field](auto& codec, auto& m, auto& s) { codec.pose(field, m, s); };
  return decoded<geometry::Pose>(fields, message, ArmBounds());
}
msg::WorkspaceObject to_idl(const WorkspaceObject& object) {
  return encoded<msg::WorkspaceObject>(kWorkspaceObject, object);
}
msg::Pose to_idl(const geometry::Pose& X) { return encoded<msg::Pose>(kPose, X); }

}  // namespace phantom::messages

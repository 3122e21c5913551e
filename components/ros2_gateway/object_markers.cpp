#include "components/ros2_gateway/object_markers.hpp"

#include <algorithm>

namespace phantom::ros2_gateway {
namespace {

constexpr float kZoneOpacity = 0.35F;

}  // namespace

void ObjectMarkers::take(const messages::WorkspaceObject& object) {
  changed_.insert(object.id);
  if (object.removed()) {
    objects_.erase(object.id);
  } else {
    objects_[object.id] = object;
  }
}

void ObjectMarkers::take(const std::vector<messages::CarriedObject>& carried) {
  for (const auto& [id, object] : carried_) changed_.insert(id);
  carried_.clear();
  for (const messages::CarriedObject& object : carried) {
    carried_[object.id] = object;
    changed_.insert(object.id);
  }
}

core::Status ObjectMarkers::take(messages::MeshChunk chunk) {
  const std::uint64_t hash = chunk.mesh_hash;
  if (meshes_.contains(hash)) return core::Status::ok();
  auto mesh = assembler_.add(std::move(chunk));
  if (!mesh || !*mesh) return mesh.status();
  const std::size_t triangles = (*mesh)->triangles.size();
  if (!make_room(triangles))
    return core::Status(core::ErrorCode::kResourceExhausted,
                        "a mesh of " + std::to_string(triangles) + " triangles; there is room for " +
                            std::to_string(kMaxTriangles - triangles_) + " more");
  triangles_ += triangles;
  meshes_[hash] = std::make_shared<const geometry::TriangleMesh>(std::move(**mesh));
  change_all_of(hash);
  return core::Status::ok();
}

/// Forgets meshes that no object names until there is room.
bool ObjectMarkers::make_room(std::size_t triangles) {
  for (auto at = meshes_.begin(); at != meshes_.end() && triangles_ + triangles > kMaxTriangles;) {
    if (named(at->first)) {
      ++at;
      continue;
    }
    triangles_ -= at->second->triangles.size();
    at = meshes_.erase(at);
  }
  return triangles_ + triangles <= kMaxTriangles;
}

bool ObjectMarkers::named(std::uint64_t mesh_hash) const {
  const auto names_it = [mesh_hash](const auto& one) { return one.second.mesh_hash == mesh_hash; };
  return std::any_of(objects_.begin(), objects_.end(), names_it) ||
         std::any_of(carried_.begin(), carried_.end(), names_it);
}

void ObjectMarkers::change_all_of(std::uint64_t mesh_hash) {
  for (const auto& [id, object] : objects_)
    if (object.mesh_hash == mesh_hash) changed_.insert(id);
}

ObjectMarker ObjectMarkers::marker(std::uint16_t id) const {
  ObjectMarker made{.id = id, .there = false, .frame = {}, .X_FO = {}, .colour = {}, .mesh = {}};
  const auto object = objects_.find(id);
  if (object == objects_.end()) return made;
  const auto mesh = meshes_.find(object->second.mesh_hash);
  if (mesh == meshes_.end()) return made;
  made.mesh = mesh->second;
  made.colour = object->second.colour;
  if (zones_.contains(id)) made.opacity = kZoneOpacity;
  made.X_FO = object->second.X_WO;
  made.there = true;
  if (const auto carried = carried_.find(id); carried != carried_.end()) {
    made.frame = carried->second.frame;
    made.X_FO = carried->second.X_FO;
    made.there = carried->second.arm == arm_name_ && arm_.find_frame(made.frame).has_value();
  }
  return made;
}

std::vector<ObjectMarker> ObjectMarkers::changes() {
  std::vector<ObjectMarker> made;
  for (const std::uint16_t id : changed_) made.push_back(marker(id));
  changed_.clear();
  return made;
}

std::vector<ObjectMarker> ObjectMarkers::all() const {
  std::vector<ObjectMarker> made;
  for (const auto& [id, object] : objects_)
    if (ObjectMarker one = marker(id); one.there) made.push_back(std::move(one));
  return made;
}

}  // namespace phantom::ros2_gateway

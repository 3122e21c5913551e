#pragma once

#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "common/geometry/mesh/mesh.hpp"
#include "common/messages/mesh_assembler.hpp"
#include "common/messages/workspace.hpp"
#include "common/robot/kinematics/serial_arm.hpp"

namespace phantom::ros2_gateway {

/// One object as a marker shows it.
struct ObjectMarker {
  std::uint16_t id = 0;
  bool there = false;                                  ///< false: removed, or without its mesh yet
  std::string frame;                                   ///< of the arm that carries it; empty: the world
  geometry::Pose X_FO;                                 ///< in that frame
  std::array<float, 3> colour{};                       ///< linear RGB
  float opacity = 1.0F;                                ///< below 1: of a protected zone
  std::shared_ptr<const geometry::TriangleMesh> mesh;  ///< in the object's frame
};

/// Keeps objects and meshes as they come in any order, and says which markers change. An object that the arm
/// carries stands in its link; one that another arm carries is not shown. Not thread-safe. Bounded: at most
/// kMaxTriangles; meshes beyond are refused.
class ObjectMarkers {
 public:
  static constexpr std::size_t kMaxTriangles = 2'000'000;

  /// `arm_name`: in the cell file. `zones`: ids of its protected zones.
  ObjectMarkers(const robot::SerialArm& arm, std::string arm_name, std::set<std::uint16_t> zones = {})
      : arm_(arm), arm_name_(std::move(arm_name)), zones_(std::move(zones)) {}

  void take(const messages::WorkspaceObject& object);
  void take(const std::vector<messages::CarriedObject>& carried);
  /// Errors: of MeshAssembler, and that there is no room.
  core::Status take(messages::MeshChunk chunk);

  /// Returns the objects that have changed since the last call.
  std::vector<ObjectMarker> changes();
  /// Returns all objects that are there.
  std::vector<ObjectMarker> all() const;

 private:
  ObjectMarker marker(std::uint16_t id) const;
  void change_all_of(std::uint64_t mesh_hash);
  bool named(std::uint64_t mesh_hash) const;
  bool make_room(std::size_t triangles);

  robot::SerialArm arm_;
  std::string arm_name_;
  std::set<std::uint16_t> zones_;
  messages::MeshAssembler assembler_;
  std::map<std::uint64_t, std::shared_ptr<const geometry::TriangleMesh>> meshes_;
  std::map<std::uint16_t, messages::WorkspaceObject> objects_;
  std::map<std::uint16_t, messages::CarriedObject> carried_;
  std::set<std::uint16_t> changed_;
  std::size_t triangles_ = 0;
};

}  // namespace phantom::ros2_gateway

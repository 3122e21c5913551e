#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <vector>

#include "common/messages/mesh_assembler.hpp"
#include "common/robot/skin/carried_skin.hpp"
#include "components/phantom_sensing/phantom_sensing.hpp"

namespace phantom::phantom_sensing {

/// The skin of an arm that carries objects.
struct CarryingSkin {
  robot::SkinLayout layout;
  robot::SkinSensing sensing;          ///< of that layout
  std::vector<std::uint16_t> objects;  ///< ids of what it carries
  std::uint64_t key = 0;               ///< SensedWorkspace::carried_key
  std::vector<LinkBox> boxes;          ///< boxes_of_share() of that layout

  CarryingSkin(robot::SkinLayout skin, const robot::SensingOptions& options, std::vector<std::uint16_t> ids)
      : layout(std::move(skin)), sensing(layout, options), objects(std::move(ids)) {}
  CarryingSkin(const CarryingSkin&) = delete;
  CarryingSkin& operator=(const CarryingSkin&) = delete;
};

/// Returns SensedWorkspace::carried_key of what an arm carries: alike for the same objects, with the same
/// meshes at the same links, in any order; wherever there they are held.
std::uint64_t key_of(std::span<const messages::CarriedObject> own);

/// Makes the skin of the phantom with what its arm carries: sensors all over each object's mesh, as on a link
/// of the arm (robot::skin_with_bodies). Collects the meshes of all objects for that. Bounded in memory. One
/// thread; not real-time safe.
class CarriedParts {
 public:
  /// Greatest memory of all meshes; those that come beyond are not kept, and cannot be carried.
  static constexpr std::size_t kMaxMeshBytes = std::size_t{512} << 20;

  /// The model must outlive this.
  CarriedParts(const PhantomModel& model, const PerceptSettings& settings, int servo_priority = 0);

  /// Takes a piece of a mesh. Returns why it cannot be used.
  core::Status put(messages::MeshChunk chunk);
  /// Returns the arm's skin with those of the objects that this arm carries; null: it carries none. Returns
  /// an error if it cannot be made: a mesh that is not whole yet (kUnavailable), no such link, too many
  /// sensors. As long as the arm carries the same in the same way, the skin is the same, too.
  core::Expected<std::shared_ptr<CarryingSkin>> skin_with(std::span<const messages::CarriedObject> carried);

 private:
  core::Expected<std::shared_ptr<CarryingSkin>> make(std::span<const messages::CarriedObject> own);
  core::Expected<const robot::BodySkin*> body(const messages::CarriedObject& object);

  const PhantomModel& model_;
  const PerceptSettings& settings_;
  int servo_priority_;
  messages::MeshAssembler assembler_;
  std::map<std::uint64_t, geometry::TriangleMesh> meshes_;  // by content hash
  std::size_t mesh_bytes_ = 0;
  std::map<std::uint64_t, robot::BodySkin> bodies_;  // likewise: of what is or was carried lately
  std::vector<messages::CarriedObject> newest_;      // what the newest skin is of
  std::shared_ptr<CarryingSkin> newest_skin_;
};

}  // namespace phantom::phantom_sensing

#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/geometry/mesh.hpp"
#include "common/robot/serial_arm.hpp"
#include "common/robot/skin.hpp"
#include "common/runtime/cell.hpp"
#include "common/simulation/contact_world.hpp"
#include "common/voxelise/distance_field.hpp"
#include "components/slave_io/config.hpp"
#include "components/slave_io/field_cache.hpp"

namespace phantom::slave_io {

/// The arm of the cell, with its start pose and tool.
struct ArmModel {
  robot::SerialArm arm;
  core::JointArray home{};
  Eigen::Vector3d tip_in_last_link_m = Eigen::Vector3d::Zero();
  std::vector<robot::LinkSkin> skin;
};

/// Loads the arm and its home pose. Throws ConfigError.
ArmModel load_arm(const runtime::CellConfig& cell, const std::string& arm_name);

/// Holds the real bodies as two distance fields: a fine one close to the surfaces, for contact, and a coarse
/// one farther out, for the clearance. One fine field for both would take a minute to build.
class FieldWorld final : public simulation::ContactWorld {
 public:
  /// Returns false to end the building with Ended. Called every few milliseconds by several threads at once.
  using KeepGoing = std::function<bool()>;
  struct Ended {};

  /// Builds the fields or reads them from `cache`. Throws ConfigError if a field cannot be built, Ended if
  /// `keep_going` returned false. Takes 1.3 s of processor time for the hot cell, shared by all cores, or 0.1
  /// s if the fields are in the cache.
  FieldWorld(const runtime::CellConfig& cell, const std::vector<voxelise::FieldBody>& bodies,
             const ContactConfig& config, const KeepGoing& keep_going = {},
             const FieldCache* cache = nullptr);

  double distance_m(const Eigen::Vector3d& p_W_m) const noexcept override;
  simulation::ContactQuery query(const Eigen::Vector3d& p_W_m) const noexcept override;
  double range_m() const noexcept override { return coarse_.outside_m() * (1.0 - 1e-6); }
  std::size_t bytes() const noexcept { return fine_.bytes() + coarse_.bytes(); }

 private:
  voxelise::DistanceField fine_, coarse_;
};

}  // namespace phantom::slave_io

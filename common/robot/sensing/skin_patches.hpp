#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "common/core/joints.hpp"
#include "common/robot/kinematics/serial_arm.hpp"
#include "common/robot/sensing/cluster_sensor.hpp"
#include "common/robot/skin/skin.hpp"
#include "common/workspace/workspace.hpp"

namespace phantom::robot {

/// Divides a skin into patches of some centimetres for display, and finds which patches meet fluid of what μ.
/// Reads the workspace sensor by sensor, independently of SkinSensing and its tick. Not thread-safe, not
/// real-time safe.
class SkinPatches {
 public:
  static constexpr std::size_t kMax = 1024;  ///< patches; the same as in SkinPercept of the IDL

  /// Divides the skin by cubes in its links' frames. The cubes' edge is 20 mm, in voxels below 5 mm four of
  /// these, or longer if that would give more than kMax patches. `arm` and `layout` must outlive this object.
  SkinPatches(const SerialArm& arm, const SkinLayout& layout, double voxel_m = 0.005);

  struct Patch {
    std::size_t link = 0;
    Eigen::Vector3d middle_m = Eigen::Vector3d::Zero();  ///< centre of its sensors, in the link's frame
    float mu = 0.0F;                                     ///< Pa·s/m, greatest that one of its sensors meets
  };
  /// Returns whether a link may touch an object. The link then does not feel the fluid of that object.
  using Muted = std::function<bool(std::size_t link, std::uint16_t object)>;
  /// Returns the patches that meet fluid at these joint positions (rad or m; finite), each with its worst
  /// sensor's μ. `closed`: share, 0…1, by which a gripper is closed; patches are those of the open one. The
  /// result is valid until the next call.
  const std::vector<Patch>& sense(const core::JointArray& position, const workspace::Workspace& workspace,
                                  const Muted& muted = {}, double closed = 0.0);

  std::size_t count() const noexcept { return patches_.size(); }
  double edge_m() const noexcept { return edge_m_; }

 private:
  bool divide(double edge_m);
  std::uint8_t code_of(std::size_t sensor, std::size_t link, workspace::Index3 at,
                       const workspace::Workspace& workspace, const Muted& muted) const;

  const SerialArm& arm_;
  const SkinLayout& layout_;
  double edge_m_ = 0.0;
  std::vector<Patch> patches_;
  std::vector<std::uint16_t> patch_of_;   // for each sensor
  std::vector<ClusterStencil> stencils_;  // for each kind of cluster
  std::vector<std::uint8_t> worst_;       // for each patch: the greatest code in this call
  std::vector<Patch> felt_;
};

}  // namespace phantom::robot

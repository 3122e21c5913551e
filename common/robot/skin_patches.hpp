#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "common/core/joints.hpp"
#include "common/robot/cluster_sensor.hpp"
#include "common/robot/serial_arm.hpp"
#include "common/robot/skin.hpp"
#include "common/workspace/workspace.hpp"

namespace phantom::robot {

/// A skin by patches of some centimetres, for eyes: which of them meet fluid, and of what μ. Looks at the
/// workspace sensor by sensor, apart from SkinSensing and its tick. Not thread-safe, not real-time safe.
class SkinPatches {
 public:
  static constexpr std::size_t kMost = 1024;  ///< patches; as idl's SkinPercept

  /// Divides the skin into the cubes of its links' frames, of the finest edge from 20 mm up that gives kMost
  /// or fewer patches. Both outlive this.
  SkinPatches(const SerialArm& arm, const SkinLayout& layout);

  struct Patch {
    std::size_t link = 0;
    Eigen::Vector3d middle_m = Eigen::Vector3d::Zero();  ///< of its sensors, in the link's frame
    float mu = 0.0F;                                     ///< Pa·s/m, greatest that a sensor meets
  };
  /// Whether a link may touch an object, whose fluid it then does not feel.
  using Muted = std::function<bool(std::size_t link, std::uint16_t object)>;
  /// The patches that meet fluid at these joint positions (rad or m; finite), each by its worst sensor. Lasts
  /// until the next call.
  const std::vector<Patch>& sense(const core::JointArray& position, const workspace::Workspace& workspace,
                                  const Muted& muted = {});

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
  std::vector<std::uint16_t> patch_of_;   // by sensor
  std::vector<ClusterStencil> stencils_;  // by cluster kind
  std::vector<std::uint8_t> worst_;       // code by patch, this time
  std::vector<Patch> felt_;
};

}  // namespace phantom::robot

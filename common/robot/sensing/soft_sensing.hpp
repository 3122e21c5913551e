#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "common/robot/drag/reaction.hpp"
#include "common/robot/sensing/skin_sensing.hpp"
#include "common/workspace/profile.hpp"

namespace phantom::robot {

/// A soft body as the orders of its voxels tell it (thesis 7.3(4)): the pressure on what has pressed in so
/// far, and by how much that rises per metre of depth. Index: the order's byte; 0 outside of the body.
struct SoftBody {
  std::uint16_t object = 0;  ///< id in the workspace
  std::array<double, 256> pressure_Pa{}, stiffness_Pa_per_m{};
};

/// Returns the soft body that a profile with stiffness makes of an object. Depth counts from the boundary
/// voxels' centres; a layer's voxels have the pressure in the middle of the layer, and those deeper than all
/// layers that of the deepest. Not real-time safe.
SoftBody soft_body(std::uint16_t object, const workspace::LayerProfile& profile, double reference_m);

/// What soft bodies do to one link, in W axes about the link's origin: a wrench, and how it changes: with a
/// the wrench of one newton along a sensor's normal, S = Σ (area · stiffness) a aᵀ, force over moment.
struct LinkReaction {
  Eigen::Vector3d force_N = Eigen::Vector3d::Zero(), moment_Nm = Eigen::Vector3d::Zero();
  Eigen::Matrix<double, 6, 6> stiffness = Eigen::Matrix<double, 6, 6>::Zero();
  bool some = false;
};
using LinkReactions = std::array<LinkReaction, core::kMaxJoints + 1>;

/// Computes how soft bodies push a skin out: each sensor in one by its area times the pressure there, which
/// is interpolated between voxels, along the way in which the pressure falls. A sensor deeper than the layers
/// by more than kReach_vox (lengths, as of layers) finds no way out, and is not pushed: it has pierced the
/// body. Whoever may touch a body (muted contacts) is not pushed either.
class SoftSensing {
 public:
  static constexpr int kReach_vox = 4;

  explicit SoftSensing(std::vector<SoftBody> bodies);
  /// After `sensed` has sensed these links, or more, with that pose in that workspace. Real-time safe: yes.
  void sense(const SkinSensing& sensed, const LinkPoses& X_WL, const workspace::Workspace& workspace,
             const LinkSet& links = all_links()) noexcept;
  const LinkReactions& links() const noexcept { return links_; }

 private:
  std::vector<SoftBody> bodies_;
  LinkReactions links_;
};

/// Turns the links' reactions into torques and stiffnesses of the joints, each for itself. Real-time safe:
/// yes.
void joint_reaction(const SerialArm& arm, const LinkPoses& X_WL, const LinkReactions& links,
                    const core::JointArray& position, JointReaction& result) noexcept;

}  // namespace phantom::robot

#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "common/layers/activation.hpp"
#include "common/layers/merge.hpp"
#include "common/robot/drag/drag.hpp"
#include "common/robot/kinematics/serial_arm.hpp"
#include "common/robot/sensing/skin_sensing.hpp"
#include "common/robot/skin/skin.hpp"
#include "common/survey/range_head.hpp"
#include "common/teleop/coupling/joint_mapping.hpp"
#include "tests/experiments/experiment.hpp"

namespace phantom::experiments {

/// The one place where a sabotage takes effect: experiments hand to the product's libraries what comes out of
/// these.

/// A shaping element as given; or the cube.
workspace::ShapingElement sabotaged(workspace::ShapingElement element, Sabotage sabotage);
/// Layers as given, by their element as above; or all with the first one's μ (less the least that "falling
/// outwards" asks for); or the first one a voxel wider, so that the others lie one too far out.
workspace::LayerProfile sabotaged(workspace::LayerProfile profile, Sabotage sabotage);
/// A speed, rad/s or m/s, as given; or always kIgnoredSpeed with its sign (0 stays 0).
double sabotaged(double speed, Sabotage sabotage);
core::JointArray sabotaged(core::JointArray speeds, Sabotage sabotage);
inline constexpr double kIgnoredSpeed = 0.05;
/// A mesh as given; or drawn out along its own axes until it reaches a voxel farther on every side.
geometry::TriangleMesh sabotaged(geometry::TriangleMesh mesh, double voxel_size_m, Sabotage sabotage);
/// A range head as given; or without the arm that its ranger sits on (r of eqs. A.7 and A.8).
survey::RangeHead sabotaged(survey::RangeHead head, Sabotage sabotage);
/// A master's joints on the arm's as given; or with the ratio 1.
teleop::JointMappingParameters sabotaged(teleop::JointMappingParameters mapping, Sabotage sabotage);

/// A cluster sensor as given; or one that reads the whole cube.
robot::ClusterSpec sabotaged(robot::ClusterSpec cluster, Sabotage sabotage);
/// The weights of past voxels as given; or that of the present one alone.
robot::MemoryWeights sabotaged(robot::MemoryWeights weights, Sabotage sabotage);

/// The value; throws std::runtime_error with the status's message if there is none.
template <class T>
T must(core::Expected<T> result) {
  if (!result) throw std::runtime_error(result.status().message());
  return std::move(result).value();
}

/// Layers of one thickness each, in voxels.
workspace::LayerProfile layers(const std::vector<float>& mu_Pa_s_per_m, int thickness_vox,
                               float mu_skin_Pa_s_per_m = 100.0F);

/// Bodies activated in a grid and merged, with their profiles sabotaged as the settings say. Objects get the
/// ids 1, 2, …
workspace::Workspace activate(std::vector<layers::Body> bodies, const workspace::GridSpec& grid,
                              const Settings& settings,
                              layers::MergeLaw law = layers::MergeLaw::kHighestViscosity);

/// What the probe met at one place.
struct Felt {
  double mu_Pa_s_per_m = 0.0;  ///< of the voxels it senses, smoothed as its options say
  Eigen::Vector3d force_N = Eigen::Vector3d::Zero();  ///< on the probe, W axes
};

/// The thesis's point robot: an arm of three prismatic joints along x, y and z of W that carries a single
/// sensor at its tip, sensed and turned into drag by the product as any arm's skin is. The sensor has weight
/// 1: F = −μ·v, in N for μ in Pa·s/m times the unit area.
class Probe {
 public:
  /// `cluster`: an enhanced sensor in place of the point.
  Probe(const workspace::Workspace& workspace, const Settings& settings,
        const robot::SensingOptions& options = {},
        const std::optional<robot::ClusterSpec>& cluster = std::nullopt);
  Felt at(const Eigen::Vector3d& p_W_m, const Eigen::Vector3d& v_W_m_per_s);
  const robot::SkinSensing& sensing() const { return sensing_; }

 private:
  const workspace::Workspace& workspace_;
  Sabotage sabotage_;
  robot::SerialArm arm_;
  robot::SkinLayout layout_;
  robot::SkinSensing sensing_;
  robot::DragCoefficients drag_;
};

}  // namespace phantom::experiments

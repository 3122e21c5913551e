#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "common/core/joints.hpp"
#include "common/geometry/mesh/mesh.hpp"
#include "common/robot/drag/medium.hpp"
#include "common/robot/kinematics/serial_arm.hpp"
#include "common/robot/skin/skin.hpp"
#include "common/simulation/mesh_surface.hpp"
#include "common/workspace/profile.hpp"

namespace phantom::simulation {

/// A layer of a soft body, from its surface inwards.
struct SoftLayer {
  double thickness_m = 0.0;           ///< > 0; of the last layer without meaning: it goes on inwards
  double stiffness_Pa_per_m = 0.0;    ///< ≥ 0: by how much the pressure on what presses in rises per metre
  double viscosity_Pa_s_per_m = 0.0;  ///< ≥ 0: stress on what moves there, per m/s
};

/// A body that gives way: what presses in is pushed out by a pressure that rises with its depth, and braked.
struct SoftSolid {
  std::uint16_t id = 0;
  geometry::TriangleMesh mesh_W;
  std::vector<SoftLayer> layers;  ///< at least one
};

/// Returns the layers of a body that a profile with stiffness makes soft: those inside it, and below them
/// the deepest one's stiffness and the viscosity of the skin.
std::vector<SoftLayer> soft_layers(const workspace::LayerProfile& profile, double reference_m);

/// A force on the joints, linear in their motion about the pose at which it was found:
/// at_rest − stiffness·(q − q0) − damping·v.
struct JointYield {
  using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor,
                               static_cast<int>(core::kMaxJoints), static_cast<int>(core::kMaxJoints)>;
  bool some = false;  ///< otherwise nothing acts, and what follows is not set
  core::JointArray at_rest{}, q0{};
  Matrix damping, stiffness;  ///< joints × joints, symmetric, positive semidefinite

  core::JointArray torque(const core::JointArray& q, const core::JointArray& v) const noexcept;
};

/// What presses a soft body.
struct SoftTouch {
  double force_N = 0.0;      ///< of the body on one link, the greatest of all links and bodies; 0: nothing
  std::uint16_t object = 0;  ///< the body
  Eigen::Vector3d point_W_m = Eigen::Vector3d::Zero();  ///< centre of that pressure
};

/// What gives way round the simulated arm: fluids that fill boxes of space, and soft bodies.
///
/// Each sensor of a skin stands for an area a. A fluid of viscosity μ that flows with u brakes it by
/// μ a (v − u). In a soft body at depth d, the pressure p(d) pushes it along the way to the nearest surface,
/// and the layer brakes it by μ(d) a v, in all directions but those in which it would be held back as it
/// leaves: a body never pulls. Where soft bodies lie in one another, the one with the greatest pressure
/// counts. Forces act at the sensors and reach the joints by Jᵀ. Loose objects feel neither.
class Yielding {
 public:
  /// `skin`: its areas count, its weights do not.
  Yielding(robot::SkinLayout skin, const robot::Medium& medium, const std::vector<SoftSolid>& bodies);
  Yielding(const Yielding&) = delete;
  Yielding& operator=(const Yielding&) = delete;

  /// Finds what acts at a pose and at velocities of the joints, with a gripper closed by `closed`, 0…1: one
  /// look-up for each sensor that is or may be in a soft body. Real-time safe: yes.
  void sense(const robot::SerialArm& arm, const robot::LinkPoses& X_WL, const core::JointArray& q,
             const core::JointArray& v, double closed) noexcept;
  const JointYield& joints() const noexcept { return joints_; }
  const SoftTouch& touch() const noexcept { return touch_; }
  bool has_soft_bodies() const noexcept { return !bodies_.empty(); }
  std::size_t sensors() const noexcept { return skin_.size(); }

 private:
  // On one link, in W axes about its origin: a wrench on it at rest, and force over moment per twist.
  struct LinkYield {
    Eigen::Matrix<double, 6, 1> at_rest = Eigen::Matrix<double, 6, 1>::Zero();
    Eigen::Matrix<double, 6, 6> damping = Eigen::Matrix<double, 6, 6>::Zero(),
                                stiffness = Eigen::Matrix<double, 6, 6>::Zero();
    bool some = false;
  };
  struct Body {
    std::uint16_t id;
    std::vector<MeshSurface> shells;
    std::vector<SoftLayer> layers;
    std::vector<double> above_Pa;  // per layer, the pressure at its outer face
  };
  // Position and distance of a sensor from a shell at its last look-up, outside of it.
  struct Seen {
    Eigen::Vector3d p_W_m = Eigen::Vector3d::Zero();
    double distance_m = 0.0;
  };
  struct Pressed {
    double pressure_Pa = 0.0;
    const SoftLayer* layer = nullptr;
    Eigen::Vector3d out_W = Eigen::Vector3d::Zero();
    std::size_t body = 0;
  };
  Pressed pressed_at(std::size_t sensor, const Eigen::Vector3d& p_W_m) noexcept;
  LinkYield in_fluid(std::size_t link) const noexcept;
  void press(std::size_t link, const geometry::Pose& X_WL, const Eigen::Matrix<double, 6, 1>& twist,
             double closed, LinkYield& yield) noexcept;

  robot::SkinLayout skin_;
  robot::MediumSensing medium_;
  bool fluids_;
  std::vector<Body> bodies_;
  std::size_t shell_count_ = 0;
  std::vector<Seen> seen_;  // sensor by sensor, of all shells
  JointYield joints_;
  SoftTouch touch_;
};

}  // namespace phantom::simulation

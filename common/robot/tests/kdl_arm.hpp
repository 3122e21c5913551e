#pragma once
// Orocos KDL's dynamics of an arm, as an independent oracle and as the plant of tests.

#include <kdl/chain.hpp>
#include <kdl/chaindynparam.hpp>

#include "common/core/joints.hpp"
#include "common/robot/kinematics/serial_arm.hpp"

namespace phantom::robot {

inline KDL::Vector kdl_of(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

inline KDL::Frame kdl_of(const geometry::Pose& pose) {
  const Eigen::Matrix3d& R = pose.rotation;
  return {KDL::Rotation(R(0, 0), R(0, 1), R(0, 2), R(1, 0), R(1, 1), R(1, 2), R(2, 0), R(2, 1), R(2, 2)),
          kdl_of(pose.translation_m)};
}

inline KDL::RigidBodyInertia kdl_body(double mass_kg, const Eigen::Vector3d& centre_m,
                                      const Eigen::Matrix3d& I) {
  return KDL::RigidBodyInertia(mass_kg, kdl_of(centre_m),
                               KDL::RotationalInertia(I(0, 0), I(1, 1), I(2, 2), I(0, 1), I(0, 2), I(1, 2)));
}

inline KDL::Segment kdl_segment(const Joint& joint, const KDL::RigidBodyInertia& carried) {
  const KDL::Frame origin = kdl_of(joint.X_parent_joint);
  const auto type = joint.type == JointType::kPrismatic ? KDL::Joint::TransAxis : KDL::Joint::RotAxis;
  return KDL::Segment(KDL::Joint(origin.p, origin.M * kdl_of(joint.axis), type), origin, carried);
}

inline KDL::Chain kdl_chain(const SerialArm& arm) {
  KDL::Chain chain;
  for (std::size_t j = 0; j < arm.joint_count(); ++j) {
    const Link& link = arm.links()[j + 1];
    chain.addSegment(
        kdl_segment(arm.joints()[j], kdl_body(link.mass_kg, link.centre_of_mass_m, link.inertia_kg_m2)));
  }
  return chain;
}

/// Mass matrix, C·v and weight of a chain whose base stands at `X_WB`, with the rotors' inertias.
class KdlDynamics {
 public:
  KdlDynamics(const KDL::Chain& chain, const geometry::Pose& X_WB, const core::JointArray& rotor)
      : rotor_(rotor),
        chain_(chain),
        parameters_(chain_,
                    kdl_of(Eigen::Vector3d(X_WB.rotation.transpose() * Eigen::Vector3d(0.0, 0.0, -9.80665)))),
        q_(chain.getNrOfJoints()),
        v_(chain.getNrOfJoints()),
        out_(chain.getNrOfJoints()),
        mass_(chain.getNrOfJoints()) {}

  Eigen::MatrixXd mass(const core::JointArray& q) {
    set(q, {});
    parameters_.JntToMass(q_, mass_);
    for (Eigen::Index j = 0; j < q_.data.size(); ++j) mass_.data(j, j) += rotor_[static_cast<std::size_t>(j)];
    return mass_.data;
  }
  Eigen::VectorXd coriolis(const core::JointArray& q, const core::JointArray& v) {
    set(q, v);
    parameters_.JntToCoriolis(q_, v_, out_);
    return out_.data;
  }
  Eigen::VectorXd weight(const core::JointArray& q) {
    set(q, {});
    parameters_.JntToGravity(q_, out_);
    return out_.data;
  }
  Eigen::Index joints() const { return q_.data.size(); }

 private:
  void set(const core::JointArray& q, const core::JointArray& v) {
    for (unsigned j = 0; j < q_.rows(); ++j) {
      q_(j) = q[j];
      v_(j) = v[j];
    }
  }
  core::JointArray rotor_;
  KDL::Chain chain_;  // KDL refers to it
  KDL::ChainDynParam parameters_;
  KDL::JntArray q_, v_, out_;
  KDL::JntSpaceInertiaMatrix mass_;
};

inline Eigen::VectorXd vector_of(const core::JointArray& values, Eigen::Index count) {
  return Eigen::Map<const Eigen::VectorXd>(values.data(), count);
}

}  // namespace phantom::robot

#include "common/simulation/indexing_hand.hpp"

namespace phantom::simulation {
namespace {

constexpr double kBack = 0.1;  // share of the reach: the handle is back, and at rest there

Eigen::Vector3d within(const Eigen::Vector3d& v, double most) noexcept {
  const double size = v.norm();
  return size > most ? Eigen::Vector3d(most / size * v) : v;
}

}  // namespace

robot::Spatial IndexingHand::step(const geometry::Pose& pose, const robot::Spatial& twist,
                                  const robot::Spatial& task) noexcept {
  const auto& p = parameters_;
  const Eigen::Vector3d turned = geometry::rotation_vector(pose.rotation);
  const auto beyond = [&](double share) {
    return pose.translation_m.norm() > share * p.reach_m || turned.norm() > share * p.reach_rad;
  };
  const bool rests = twist.head<3>().norm() < p.reach_m && twist.tail<3>().norm() < p.reach_rad;
  clutch_ = clutch_ ? !beyond(1.0) : !beyond(kBack) && rests;
  if (clutch_) return task;
  robot::Spatial back;
  back.head<3>() =
      within(-p.stiffness_N_per_m * pose.translation_m, p.force_N) - p.damping_N_s_per_m * twist.head<3>();
  back.tail<3>() =
      within(-p.stiffness_Nm_per_rad * turned, p.moment_N_m) - p.damping_Nm_s_per_rad * twist.tail<3>();
  return back;
}

}  // namespace phantom::simulation

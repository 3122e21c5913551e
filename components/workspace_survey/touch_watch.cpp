#include "components/workspace_survey/touch_watch.hpp"

#include <spdlog/fmt/fmt.h>

#include <Eigen/Geometry>
#include <Eigen/QR>

#include "common/robot/kinematics/jacobian.hpp"

namespace phantom::workspace_survey {
namespace {

constexpr double kFree_s = 0.1;        // so long without contact, and the next one is a new touch
constexpr double kBeginning_s = 0.03;  // of a contact, over which the force's direction is averaged
constexpr double kMinForce_N = 0.5;    // of the mean: less has no direction
constexpr double kUnexplained = 0.2;   // share of the torques that a force at the place may leave unexplained
constexpr double kBesideTip_m =
    0.01;  // a contact farther from the ball's surface than this is not the ball's

}  // namespace

TouchWatch::TouchWatch(const robot::SerialArm& arm, const TouchWatchOptions& options)
    : arm_(arm), options_(options) {}

Eigen::Vector3d TouchWatch::force_W_N(const messages::SlaveState& state, const Eigen::Vector3d& p_W_m) const {
  if (!state.force_measured) return Eigen::Vector3d::Zero();
  const std::size_t count = arm_.joint_count();
  Eigen::Matrix<double, Eigen::Dynamic, 3> torque_of_force(count, 3);
  Eigen::VectorXd torque(count);
  for (int axis = 0; axis < 3; ++axis) {
    core::JointArray column{};
    arm_.add_force(count, p_W_m, Eigen::Vector3d::Unit(axis), X_WL_, column);
    for (std::size_t j = 0; j < count; ++j) torque_of_force(static_cast<Eigen::Index>(j), axis) = column[j];
  }
  for (std::size_t j = 0; j < count; ++j) torque[static_cast<Eigen::Index>(j)] = state.external_torque_Nm[j];
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> solver(torque_of_force);
  if (solver.rank() < 3) return Eigen::Vector3d::Zero();
  const Eigen::Vector3d force_N = solver.solve(torque);
  // Torques that no force at this place explains are those of a contact elsewhere.
  if ((torque_of_force * force_N - torque).norm() > kUnexplained * torque.norm())
    return Eigen::Vector3d::Zero();
  return force_N;
}

TouchWatch::Beginning TouchWatch::begin(const messages::SlaveState& state, double now_s,
                                        std::uint16_t object) const {
  Beginning beginning{.since_s = now_s, .touch = {.sigma_m = options_.sigma_m}, .refusal = ""};
  const bool located = state.contact_force_N >= 0;
  const Eigen::Vector3d contact_W_m(state.contact_point_m[0], state.contact_point_m[1],
                                    state.contact_point_m[2]);
  beginning.touch.p_W_m = options_.tip_radius_m ? tip_W_m_ : contact_W_m;
  beginning.touch.radius_m = options_.tip_radius_m.value_or(0.0);
  if (state.contact_object != 0 && state.contact_object != object) {
    beginning.refusal = fmt::format("it is of another object (id {})", state.contact_object);
  } else if (!options_.tip_radius_m && !located) {
    beginning.refusal = "the arm does not say where it is touched; give the tool's tip: --tip-radius-mm";
  } else if (options_.tip_radius_m && located &&
             (contact_W_m - tip_W_m_).norm() > *options_.tip_radius_m + kBesideTip_m) {
    beginning.refusal =
        fmt::format("it is {:.0f} mm beside the tool's tip", 1e3 * (contact_W_m - tip_W_m_).norm());
  }
  return beginning;
}

std::optional<FeltContact> TouchWatch::take(const messages::SlaveState& state, double now_s,
                                            std::uint16_t object) {
  arm_.link_poses(state.position, X_WL_);
  tip_W_m_ = robot::tool_pose(arm_, X_WL_).translation_m;
  touching_ = state.contact;
  if (!state.contact) {
    if (free_since_s_ < 0) free_since_s_ = now_s;
    if (now_s - free_since_s_ >= kFree_s && !beginning_) handled_ = false;
  } else {
    free_since_s_ = -1.0;
    if (handled_) return std::nullopt;
    if (!beginning_) beginning_ = begin(state, now_s, object);
    beginning_->force_sum_N += force_W_N(state, beginning_->touch.p_W_m);
  }
  if (!beginning_ || now_s - beginning_->since_s < kBeginning_s) return std::nullopt;
  FeltContact felt{beginning_->touch, beginning_->refusal};
  if (beginning_->force_sum_N.norm() > kMinForce_N)
    felt.touch->normal_W = beginning_->force_sum_N.normalized();
  if (!felt.refusal.empty()) felt.touch.reset();
  beginning_.reset();
  handled_ = true;
  return felt;
}

std::optional<survey::FreePlace> TouchWatch::free_place() const {
  if (!options_.tip_radius_m || touching_) return std::nullopt;
  return survey::FreePlace{tip_W_m_, *options_.tip_radius_m, options_.sigma_m};
}

}  // namespace phantom::workspace_survey

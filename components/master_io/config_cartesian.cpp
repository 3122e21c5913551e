#include "components/master_io/config_cartesian.hpp"

#include <numbers>

namespace phantom::master_io {
namespace {

using runtime::Fields;

void read_handle(const Fields& section, CartesianConfig& config) {
  auto& handle = config.handle;
  handle.moved.inertia = config.hand.map.mass_kg;
  handle.turned.inertia = config.hand.map.inertia_kg_m2;
  section.number("viscous_N_s_per_m", handle.moved.viscous);
  section.number("coulomb_N", handle.moved.coulomb);
  section.number("viscous_N_m_s_per_rad", handle.turned.viscous);
  section.number("coulomb_N_m", handle.turned.coulomb);
  handle.moved.upper = section.value("workspace_m", 0.15);
  handle.moved.lower = -handle.moved.upper;
  handle.turned.upper = section.value("workspace_rad", 1.2);
  section.number("encoder_step_m", handle.encoder_step_m);
  section.number("encoder_step_rad", handle.encoder_step_rad);
  section.number("velocity_filter_s", handle.velocity_filter_s);
  handle.force_limit_N = config.wrench.force_cap_N;
  handle.moment_limit_N_m = config.wrench.moment_cap_N_m;
  if (is_pushed(config.input)) {
    handle.moved.upper = 1e9, handle.moved.lower = -1e9;
    handle.turned.upper = 10.0;  // beyond every rotation
  }
  // A person turns back before the end stop.
  config.indexing.reach_m = 0.75 * handle.moved.upper;
  config.indexing.reach_rad = 0.75 * handle.turned.upper;
}

}  // namespace

CartesianConfig read_cartesian(const Fields& section, const robot::SerialArm& arm,
                               const core::JointArray& joint_inertia, double loop_s) {
  CartesianConfig config;
  auto& hand = config.hand;
  section.choice("input", config.input,
                 {{"simulated", CartesianInput::kSimulated},
                  {"space_mouse", CartesianInput::kSpaceMouse},
                  {"gamepad", CartesianInput::kGamepad},
                  {"haptic_device", CartesianInput::kHapticDevice}});
  using enum teleop::HandFrame;
  section.choice("frame", hand.frame, {{"base", kBase}, {"view", kView}, {"tool", kTool}});
  const Eigen::Vector3d rpy = std::numbers::pi / 180.0 * section.vector3("device_rpy_deg");
  hand.R_FD = geometry::rotation_from_rpy(rpy.x(), rpy.y(), rpy.z());
  section.flag("orientation", hand.map.orientation);
  section.number("scale", hand.scale);
  section.number("rotation_scale", hand.rotation_scale);
  section.number("clutch_fade_s", hand.clutch_fade_s);
  section.number("singular_below", hand.map.singular_below);
  const double speed_share = section.value("speed_share", 0.8);
  hand.map.joint_count = arm.joint_count();
  hand.map.inertia = joint_inertia;
  for (std::size_t j = 0; j < arm.joint_count(); ++j)
    hand.max_speed[j] = speed_share * arm.joints()[j].max_speed;
  hand.map.mass_kg = section.value("mass_kg");
  hand.map.inertia_kg_m2 = section.value("inertia_kg_m2");
  config.wrench = {.force_cap_N = section.value("force_limit_N"),
                   .moment_cap_N_m = section.value("moment_limit_N_m"),
                   .force_rate_N_per_s = section.value("force_rate_N_per_s"),
                   .moment_rate_Nm_per_s = section.value("moment_rate_N_m_per_s")};
  read_handle(section.section("simulated"), config);
  const Fields device = section.section("haptic_device");
  device.number("staleness_s", config.watch.staleness_s);
  device.number("round_trip_limit_s", config.watch.round_trip_limit_s);
  config.watch.loop_s = loop_s;
  return config;
}

core::JointArray tool_coordinates(const CartesianConfig& config, const Eigen::Matrix3d& R_home,
                                  const geometry::Pose& X_WT) noexcept {
  const Eigen::Vector3d turned = geometry::rotation_vector(X_WT.rotation * R_home.transpose());
  core::JointArray x{};
  for (int i = 0; i < 3; ++i) {
    x[static_cast<std::size_t>(i)] = X_WT.translation_m[i] / config.hand.scale;
    x[static_cast<std::size_t>(i) + 3] =
        config.hand.map.orientation ? turned[i] / config.hand.rotation_scale : 0.0;
  }
  return x;
}

geometry::Pose tool_pose_at(const robot::SerialArm& arm, const core::JointArray& q) noexcept {
  robot::LinkPoses X_WL;
  arm.link_poses(q, X_WL);
  return robot::tool_pose(arm, X_WL);
}

}  // namespace phantom::master_io

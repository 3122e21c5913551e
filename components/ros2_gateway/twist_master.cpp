#include "components/ros2_gateway/twist_master.hpp"

#include <algorithm>
#include <cmath>

namespace phantom::ros2_gateway {
namespace {

constexpr double kReturn_per_s = 2.0;                        // to the middle of the way
constexpr double kFastest_m_s = 1.0, kFastest_rad_s = 10.0;  // whatever pushes
constexpr double kMiddle_m = 0.01;

void limit(Eigen::Ref<Eigen::Vector3d> v, double largest) {
  const double length = v.norm();
  if (length > largest) v *= largest / length;
}

}  // namespace

TwistMaster::TwistMaster(const TwistMasterRules& rules)
    : rules_(rules), check_(rules.staleness_s, rules.largest_stamp_age_s) {}

core::Status TwistMaster::take_twist(const StreamMessage& from, const std::array<double, 3>& linear_m_s,
                                     const std::array<double, 3>& angular_rad_s, core::Nanoseconds now_ns,
                                     core::Nanoseconds utc_now_ns) {
  robot::Spatial twist;
  twist << Eigen::Vector3d(linear_m_s.data()), Eigen::Vector3d(angular_rad_s.data());
  return take(from, twist, true, now_ns, utc_now_ns);
}

core::Status TwistMaster::take_joy(const StreamMessage& from, std::span<const float> axes,
                                   std::span<const std::int32_t> buttons, core::Nanoseconds now_ns,
                                   core::Nanoseconds utc_now_ns) {
  if (rules_.joy_enable >= static_cast<int>(buttons.size()))
    return core::Status::invalid_argument("no button " + std::to_string(rules_.joy_enable) + " among " +
                                          std::to_string(buttons.size()));
  robot::Spatial twist = robot::Spatial::Zero();
  for (int i = 0; i < 6; ++i) {
    const int axis = rules_.joy_axes[static_cast<std::size_t>(i)];
    if (axis < 0) continue;
    if (axis >= static_cast<int>(axes.size()))
      return core::Status::invalid_argument("no axis " + std::to_string(axis) + " among " +
                                            std::to_string(axes.size()));
    twist[i] = static_cast<double>(axes[static_cast<std::size_t>(axis)]) *
               (i < 3 ? rules_.largest_speed_m_s : rules_.largest_turn_rad_s);
  }
  return take(from, twist, buttons[static_cast<std::size_t>(rules_.joy_enable)] != 0, now_ns, utc_now_ns);
}

core::Status TwistMaster::take(const StreamMessage& from, const robot::Spatial& twist, bool enabled,
                               core::Nanoseconds now_ns, core::Nanoseconds utc_now_ns) {
  if (!twist.allFinite()) return core::Status::invalid_argument("a number that is none");
  const bool heard = check_.fresh(now_ns);
  const core::Status status = check_.accept(from, now_ns, utc_now_ns);
  if (!status) return status;
  if (!heard) seen_at_rest_ = false;
  command_ = twist;
  limit(command_.head<3>(), rules_.largest_speed_m_s);
  limit(command_.tail<3>(), rules_.largest_turn_rad_s);
  enabled_ = enabled;
  if (!returning_ && (!enabled || command_.isZero(0.0))) seen_at_rest_ = true;
  return core::Status::ok();
}

const TwistMaster::Handle& TwistMaster::step(const robot::Spatial& wrench, bool taken, double dt_s,
                                             core::Nanoseconds now_ns) noexcept {
  const bool heard = check_.fresh(now_ns);
  if (taken) taken_ns_ = now_ns;
  const bool served = taken_ns_ != 0 && core::seconds(now_ns - taken_ns_) <= rules_.staleness_s;
  if (!heard || !served) seen_at_rest_ = false;
  Eigen::Vector3d& p = handle_.X_DH.translation_m;
  if (p.cwiseAbs().maxCoeff() > kWay_m) {
    returning_ = true;
    seen_at_rest_ = false;
  }
  handle_.clutch = heard && enabled_ && seen_at_rest_;
  robot::Spatial wanted = robot::Spatial::Zero();
  if (handle_.clutch) {
    wanted = command_;
    if (wrench.allFinite()) {
      wanted.head<3>() += wrench.head<3>() / rules_.push_N_s_per_m;
      wanted.tail<3>() += wrench.tail<3>() / rules_.push_N_m_s_per_rad;
    }
  } else {
    wanted.head<3>() = -kReturn_per_s * p;
    limit(wanted.head<3>(), kFastest_m_s);
    if (p.norm() < kMiddle_m) returning_ = false;
  }
  // m·dv/dt = push·(wanted − v), exactly over the step.
  robot::Spatial& v = handle_.twist;
  const double moved = -std::expm1(-dt_s * rules_.push_N_s_per_m / rules_.mass_kg);
  const double turned = -std::expm1(-dt_s * rules_.push_N_m_s_per_rad / rules_.inertia_kg_m2);
  v.head<3>() += moved * (wanted.head<3>() - v.head<3>());
  v.tail<3>() += turned * (wanted.tail<3>() - v.tail<3>());
  limit(v.head<3>(), kFastest_m_s);
  limit(v.tail<3>(), kFastest_rad_s);
  p += dt_s * v.head<3>();
  handle_.X_DH.rotation = geometry::rotation_from_vector(dt_s * v.tail<3>()) * handle_.X_DH.rotation;
  // Rounding must not make it something else than a rotation, however long it turns.
  handle_.X_DH.rotation =
      geometry::rotation_from_quaternion(geometry::quaternion_xyzw(handle_.X_DH.rotation));
  return handle_;
}

}  // namespace phantom::ros2_gateway

#include "common/teleop/guards/wrist_sensor.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

namespace phantom::teleop {
namespace {

Wrench operator-(const Wrench& a, const Wrench& b) {
  return {a.force_N - b.force_N, a.torque_Nm - b.torque_Nm};
}

// Less by the threshold, towards zero, in its own direction.
Eigen::Vector3d beyond(const Eigen::Vector3d& v, double threshold) {
  const double size = v.norm();
  return size > threshold ? Eigen::Vector3d(v * (1.0 - threshold / size)) : Eigen::Vector3d::Zero();
}

}  // namespace

WristState WristSensor::assess(const WristSample& sample) const noexcept {
  const Wrench& w = sample.wrench;
  if (!(sample.age_s < std::numeric_limits<double>::infinity())) return WristState::kSilent;
  if (!(sample.age_s <= parameters_.staleness_s)) return WristState::kStale;
  if (!sample.valid || !w.force_N.allFinite() || !w.torque_Nm.allFinite()) return WristState::kInvalid;
  const bool rated = (w.force_N.array().abs() < parameters_.rated_N.array()).all() &&
                     (w.torque_Nm.array().abs() < parameters_.rated_Nm.array()).all();
  return rated ? WristState::kMeasured : WristState::kSaturated;
}

Wrench WristSensor::without_weight(const Wrench& wrench, const robot::LinkPoses& X_WL) const noexcept {
  const Eigen::Matrix3d R_WS = X_WL[parameters_.link].rotation * parameters_.X_LS.rotation;
  const Eigen::Vector3d weight_N =
      R_WS.transpose() * Eigen::Vector3d(0.0, 0.0, -robot::kGravity_m_s2 * parameters_.payload_kg);
  return wrench - Wrench{weight_N, parameters_.payload_centre_m.cross(weight_N)};
}

bool WristSensor::is_offset(const Wrench& unloaded) const noexcept {
  return unloaded.force_N.norm() <= parameters_.most_offset_N &&
         unloaded.torque_Nm.norm() <= parameters_.most_offset_Nm;
}

bool WristSensor::moves(const core::JointArray& v) const noexcept {
  for (std::size_t j = 0; j < arm_.joint_count(); ++j) {
    if (!(std::abs(v[j]) <= parameters_.still[j])) return true;
  }
  return false;
}

// Takes a fresh sample into the average. Returns what has become of the tare.
TareState WristSensor::tare_after(const Wrench& unloaded) noexcept {
  if (tare_.samples == 0) tare_.first = unloaded;
  const Wrench change = unloaded - tare_.first;
  if (!is_offset(unloaded) || change.force_N.norm() > parameters_.threshold_N ||
      change.torque_Nm.norm() > parameters_.threshold_Nm)
    return TareState::kTouched;
  tare_.sum.force_N += unloaded.force_N;
  tare_.sum.torque_Nm += unloaded.torque_Nm;
  ++tare_.samples;
  if (tare_.for_s < parameters_.tare_s) return TareState::kRuns;
  offset_ = {tare_.sum.force_N / tare_.samples, tare_.sum.torque_Nm / tare_.samples};
  tared_ = true;
  force_.offset_N = offset_.force_N.norm();
  force_.offset_Nm = offset_.torque_Nm.norm();
  return TareState::kDone;
}

// A tare that could not begin ends at once, as one that may not go on does.
void WristSensor::step_tare(const WristSample& sample, const Wrench& unloaded, TareRefusal obstacle,
                            double dt_s) noexcept {
  const bool requested = std::exchange(tare_requested_, false), runs = force_.tare == TareState::kRuns;
  force_.refusal = runs ? TareRefusal::kRuns : obstacle;
  if (!runs && !requested) return;
  if (!runs) tare_ = {};
  tare_.for_s += dt_s;
  switch (obstacle) {
    case TareRefusal::kNotMeasured:
      force_.tare = TareState::kLost;
      break;
    case TareRefusal::kMoves:
      force_.tare = TareState::kMoved;
      break;
    case TareRefusal::kTouched:
      force_.tare = TareState::kTouched;
      break;
    default:
      force_.tare = sample.fresh ? tare_after(unloaded) : TareState::kRuns;
  }
}

void WristSensor::filter(const Wrench& now) noexcept {
  const double share = filtering_ ? since_sample_s_ / (since_sample_s_ + parameters_.filter_s) : 1.0;
  felt_.force_N += share * (now.force_N - felt_.force_N);
  felt_.torque_Nm += share * (now.torque_Nm - felt_.torque_Nm);
  since_sample_s_ = 0.0;
  filtering_ = true;
}

const WristForce& WristSensor::step(const WristSample& sample, const robot::LinkPoses& X_WL,
                                    const core::JointArray& v, bool touched, double dt_s) noexcept {
  WristState state = assess(sample);
  const bool usable = state == WristState::kMeasured;
  const Wrench unloaded = usable ? without_weight(sample.wrench, X_WL) : Wrench{};
  step_tare(sample, unloaded,
            !usable                           ? TareRefusal::kNotMeasured
            : moves(v)                        ? TareRefusal::kMoves
            : touched || !is_offset(unloaded) ? TareRefusal::kTouched
                                              : TareRefusal::kNone,
            dt_s);
  if (usable && force_.tare == TareState::kRuns) {
    state = WristState::kTaring;
  } else if (usable && parameters_.needs_tare && !tared_) {
    state = WristState::kNotTared;
  }
  const bool good = state == WristState::kMeasured;
  good_s_ = good ? good_s_ + dt_s : 0.0;
  since_sample_s_ += dt_s;
  filtering_ = filtering_ && good;
  if (good && (sample.fresh || !filtering_)) filter(unloaded - offset_);
  if (good && good_s_ < kRecovery_s) state = WristState::kSettling;
  force_.state = state;
  force_.torque_Nm = {};
  force_.contact = force_.has_line = false;
  force_.force_N = -1.0;
  if (force_.measured()) {
    measure(X_WL, dt_s);
  } else {
    contact_.release();
  }
  return force_;
}

// With f at p, the torque about S is (p − p_S) × f, so f × torque = |f|² · (the part of p − p_S across f).
void WristSensor::measure(const robot::LinkPoses& X_WL, double dt_s) noexcept {
  const geometry::Pose X_WS = X_WL[parameters_.link] * parameters_.X_LS;
  const Eigen::Vector3d f_W_N = X_WS.rotation * felt_.force_N;
  force_.force_N = f_W_N.norm();
  force_.contact = contact_.step(
      std::max(force_.force_N / parameters_.threshold_N, felt_.torque_Nm.norm() / parameters_.threshold_Nm),
      dt_s);
  if (force_.contact && force_.force_N > ContactLatch::kReleaseShare * parameters_.threshold_N) {
    const Eigen::Vector3d along = f_W_N / force_.force_N;
    const Eigen::Vector3d across_m =
        along.cross(Eigen::Vector3d(X_WS.rotation * felt_.torque_Nm)) / force_.force_N;
    const Eigen::Vector3d nearest_m = X_WS.translation_m + across_m;
    const Eigen::Vector3d tip_m = X_WL[parameters_.link] * tip_in_link_m_;
    const Eigen::Vector3d point_m = nearest_m + along * along.dot(tip_m - nearest_m);
    force_.has_line = across_m.norm() <= kFarthest_m;
    if (force_.has_line) force_.on_line_W_m = {point_m.x(), point_m.y(), point_m.z()};
  }
  const Eigen::Vector3d force_W_N = X_WS.rotation * beyond(felt_.force_N, parameters_.threshold_N),
                        torque_W_Nm = X_WS.rotation * beyond(felt_.torque_Nm, parameters_.threshold_Nm);
  arm_.add_force(parameters_.link, X_WS.translation_m, force_W_N, X_WL, force_.torque_Nm);
  arm_.add_torque(parameters_.link, torque_W_Nm, X_WL, force_.torque_Nm);
}

}  // namespace phantom::teleop

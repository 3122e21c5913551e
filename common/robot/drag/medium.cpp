#include "common/robot/drag/medium.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>

namespace phantom::robot {
namespace {

void add_sensor(double weight, const Eigen::Vector3d& d_m, ViscousSums& sums) noexcept {
  sums.mu += weight;
  sums.mu_d += weight * d_m;
  sums.mu_dd += weight * d_m * d_m.transpose();
}

bool is_finite(const geometry::Pose& pose) noexcept {
  return pose.translation_m.allFinite() && pose.rotation.allFinite();
}

/// Returns Σ J_jᵀ f over all links that joint j moves, for every joint: what holds the joints at rest in the
/// current.
core::JointArray joint_push(const SerialArm& arm, const LinkPoses& X_WL,
                            const MediumLinkSums& sums) noexcept {
  core::JointArray push{};
  Eigen::Vector3d force = Eigen::Vector3d::Zero(), moment = Eigen::Vector3d::Zero();
  for (std::size_t j = arm.joint_count(); j-- > 0;) {
    const Eigen::Vector3d& origin = X_WL[j + 1].translation_m;
    if (j + 1 < arm.joint_count()) moment += (X_WL[j + 2].translation_m - origin).cross(force);
    force += sums[j + 1].push;
    moment += sums[j + 1].push_moment;
    const bool slides = arm.joints()[j].type == JointType::kPrismatic;
    push[j] = arm.axis_W(j, X_WL).dot(slides ? force : moment);
  }
  return push;
}

/// Solves D·c = b. D may be singular, as where a joint only spins about a link's own axis; then a millionth
/// more on the diagonal keeps c finite.
core::JointArray coupled_drift(const DragCoefficients& drag, const core::JointArray& push,
                               std::size_t count) noexcept {
  constexpr int kMax = static_cast<int>(core::kMaxJoints);
  constexpr double kMore = 1.0 + 1e-6;
  const auto n = static_cast<Eigen::Index>(count);
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMax, kMax> d(n, n);
  Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, kMax, 1> b(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    b[i] = push[static_cast<std::size_t>(i)];
    for (Eigen::Index j = 0; j < n; ++j)
      d(i, j) = drag.matrix(static_cast<std::size_t>(i), static_cast<std::size_t>(j));
    d(i, i) = d(i, i) > 0.0 ? kMore * d(i, i) : 1.0;  // a joint that feels nothing is not pushed either
  }
  b = d.llt().solve(b).eval();
  core::JointArray drift{};
  if (b.allFinite()) std::copy(b.begin(), b.end(), drift.begin());
  return drift;
}

}  // namespace

Cover cover_of(const MediumRegion& region, const Eigen::Vector3d& centre_m, double radius_m) noexcept {
  const Eigen::Array3d c = centre_m.array();
  const double r = radius_m + 1e-9;
  if ((c + r < region.min_m.array()).any() || (c - r > region.max_m.array()).any()) return Cover::kNone;
  const bool inside = (c - r >= region.min_m.array()).all() && (c + r < region.max_m.array()).all();
  return inside ? Cover::kAll : Cover::kPart;
}

MediumSensing::MediumSensing(const SkinLayout& layout, Medium medium)
    : layout_(layout), medium_(std::move(medium)) {
  if (medium_.empty()) return;
  for (std::size_t link = 0; link <= core::kMaxJoints; ++link) {
    for (std::size_t first = layout.first[link]; first < layout.first[link + 1]; first += kBlock)
      blocks_[link].push_back(block_of(first, std::min(first + kBlock, layout.first[link + 1])));
  }
}

MediumSensing::Block MediumSensing::block_of(std::size_t first, std::size_t end) const {
  Block block{first, end, false, Eigen::Vector3d::Zero(), 0.0, {}};
  Eigen::Vector3d least = layout_.position(first), greatest = least;
  for (std::size_t i = first; i < end; ++i) {
    const Eigen::Vector3d p_m = layout_.position(i);
    least = least.cwiseMin(p_m);
    greatest = greatest.cwiseMax(p_m);
    add_sensor(layout_.weight[i], p_m, block.unit);
    block.moves = block.moves || (!layout_.closing_m.empty() && !layout_.closing_m[i].isZero(0.0));
  }
  block.centre_m = 0.5 * (least + greatest);
  block.radius_m = 0.5 * (greatest - least).norm();
  return block;
}

const MediumRegion* MediumSensing::region_at(const Eigen::Vector3d& p_W_m) const noexcept {
  const auto found = std::find_if(medium_.rbegin(), medium_.rend(),
                                  [&](const MediumRegion& region) { return region.contains(p_W_m); });
  return found == medium_.rend() ? nullptr : &*found;
}

/// Adds a block's sums. Returns how many of its sensors are in a medium.
std::size_t MediumSensing::add_block(const Block& block, const geometry::Pose& X_WL, double closed,
                                     MediumSums& sums) const noexcept {
  const auto add = [&sums](const ViscousSums& unit, const MediumRegion& region) {
    ViscousSums fluid = unit;
    fluid.scale(region.mu_Pa_s_per_m);
    sums.fluid.add(fluid);
    sums.push += fluid.mu * region.current_m_s;
    sums.push_moment += fluid.mu_d.cross(region.current_m_s);
  };
  auto region = medium_.rbegin();
  Cover cover = Cover::kNone;
  for (; region != medium_.rend() && cover == Cover::kNone; ++region)
    cover = cover_of(*region, X_WL * block.centre_m, block.radius_m);
  const Eigen::Matrix3d& R = X_WL.rotation;
  if (!block.moves && cover == Cover::kNone) return 0;
  if (!block.moves && cover == Cover::kAll) {
    ViscousSums unit;
    unit.mu = block.unit.mu;
    unit.mu_d = R * block.unit.mu_d;
    unit.mu_dd = R * block.unit.mu_dd * R.transpose();
    add(unit, *std::prev(region));
    return block.end - block.first;
  }
  std::size_t immersed = 0;
  for (std::size_t i = block.first; i < block.end; ++i) {
    const Eigen::Vector3d p_L_m = layout_.position(i, closed);
    const MediumRegion* const there = region_at(X_WL * p_L_m);
    if (there == nullptr) continue;
    ViscousSums unit;
    add_sensor(layout_.weight[i], R * p_L_m, unit);
    add(unit, *there);
    ++immersed;
  }
  return immersed;
}

void MediumSensing::sense(const LinkPoses& X_WL, std::size_t joint_count, double closed) noexcept {
  if (medium_.empty()) return;
  sums_ = {};
  for (std::size_t link = 1; link <= joint_count; ++link) {
    if (!is_finite(X_WL[link])) continue;
    MediumSums& sums = sums_[link];
    std::size_t immersed = 0;
    for (const Block& block : blocks_[link]) immersed += add_block(block, X_WL[link], closed, sums);
    if (layout_.normalisation != Normalisation::kActive || immersed == 0) continue;
    const double share = 1.0 / static_cast<double>(immersed);
    sums.fluid.scale(share);
    sums.push *= share;
    sums.push_moment *= share;
  }
}

void add_medium_drag(const SerialArm& arm, const LinkPoses& X_WL, const MediumLinkSums& sums, DragMode mode,
                     DragCoefficients& result) noexcept {
  LinkSums fluid;
  bool some = false, flows = false;
  for (std::size_t link = 1; link <= arm.joint_count(); ++link) {
    fluid[link] = sums[link].fluid;
    some = some || fluid[link].mu > 0.0;
    flows = flows || !sums[link].push.isZero(0.0) || !sums[link].push_moment.isZero(0.0);
  }
  if (!some) return;
  DragCoefficients medium;
  drag_coefficients(arm, X_WL, fluid, {}, {}, medium);
  for (std::size_t j = 0; j < arm.joint_count(); ++j) {
    result.plus[j] += medium.plus[j];
    result.minus[j] += medium.minus[j];
  }
  for (std::size_t k = 0; k < kPackedMatrix; ++k) result.coupled[k] += medium.coupled[k];
  if (!flows) return;
  const core::JointArray push = joint_push(arm, X_WL, sums);
  if (mode == DragMode::kCoupled) {
    result.drift = coupled_drift(result, push, arm.joint_count());
    return;
  }
  for (std::size_t j = 0; j < arm.joint_count(); ++j) {
    const double own = result.matrix(j, j);
    result.drift[j] = own > 0.0 ? push[j] / own : 0.0;
  }
}

}  // namespace phantom::robot

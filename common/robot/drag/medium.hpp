#pragma once

#include <Eigen/Core>
#include <array>
#include <limits>
#include <optional>
#include <vector>

#include "common/robot/drag/drag.hpp"
#include "common/robot/skin/skin.hpp"

namespace phantom::robot {

/// A fluid that fills a box of space by itself, whether objects are near or not (thesis 7.3(5)): the water of
/// a pool, a jet in it. Box and current are in W; the box is [min, max), and without end as it stands here.
struct MediumRegion {
  double mu_Pa_s_per_m = 0.0;  ///< ≥ 0
  Eigen::Vector3d min_m = Eigen::Vector3d::Constant(-std::numeric_limits<double>::infinity());
  Eigen::Vector3d max_m = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity());
  Eigen::Vector3d current_m_s = Eigen::Vector3d::Zero();  ///< velocity at which the fluid flows
  /// ≥ 0; none: that of the region before it that holds a point (a jet is of the water it flows in), of air
  /// 0.
  std::optional<double> density_kg_per_m3 = {};

  bool contains(const Eigen::Vector3d& p_W_m) const noexcept {
    return (p_W_m.array() >= min_m.array()).all() && (p_W_m.array() < max_m.array()).all();
  }
};

/// Where regions overlap, the last one that holds a point counts. Where there is none, the medium is air,
/// which is not felt.
using Medium = std::vector<MediumRegion>;

enum class Cover { kNone, kPart, kAll };
/// Returns how much of a sphere in W a region holds. What cannot be decided within rounding is a part.
/// Real-time safe: yes.
Cover cover_of(const MediumRegion& region, const Eigen::Vector3d& centre_m, double radius_m) noexcept;

/// What a medium does to one link: sums over its sensors that are in it, in W axes about the link's origin,
/// with the sensors' velocity u_i of the fluid.
struct MediumSums {
  ViscousSums fluid;  ///< Σ wμ, Σ wμ d, Σ wμ d dᵀ; a medium has no gradient
  Eigen::Vector3d push = Eigen::Vector3d::Zero();  ///< Σ wμ u: drag of the current on the link at rest
  Eigen::Vector3d push_moment = Eigen::Vector3d::Zero();  ///< Σ d×(wμ u)
};
using MediumLinkSums = std::array<MediumSums, core::kMaxJoints + 1>;

/// Computes what a medium does to a skin. It adds to the fluid of objects and does not hide it: a layer is
/// felt as the same step in water as in air. Intended contacts do not mute it. A block of sensors that lies
/// in one region as a whole costs the same as one sensor; the others are looked at one by one.
class MediumSensing {
 public:
  /// The layout must outlive this.
  MediumSensing(const SkinLayout& layout, Medium medium);
  /// Senses with links 1 … `joint_count` and a gripper that is closed by `closed`, 0…1. A link whose pose is
  /// not finite feels nothing. Real-time safe: yes.
  void sense(const LinkPoses& X_WL, std::size_t joint_count, double closed) noexcept;
  const MediumLinkSums& sums() const noexcept { return sums_; }

 private:
  static constexpr std::size_t kBlock = 256;
  /// Sensors first … end − 1 of a link; sphere and sums (Σw, Σw p, Σw ppᵀ) in the link's frame.
  struct Block {
    std::size_t first, end;
    bool moves;  // as the gripper closes
    Eigen::Vector3d centre_m;
    double radius_m;
    ViscousSums unit;
  };
  Block block_of(std::size_t first, std::size_t end) const;
  std::size_t add_block(const Block& block, const geometry::Pose& X_WL, double closed,
                        MediumSums& sums) const noexcept;
  const MediumRegion* region_at(const Eigen::Vector3d& p_W_m) const noexcept;

  const SkinLayout& layout_;
  Medium medium_;
  std::array<std::vector<Block>, core::kMaxJoints + 1> blocks_;
  MediumLinkSums sums_;
};

/// Adds the drag of the medium to the coefficients and sets their `drift`, c, so that at every velocity v the
/// medium's force is that of the velocity relative to it, B·(v − c) and D·(v − c): with b_l = Σ J_lᵀ wμ u,
/// c_l = b_l/B_l (separable), or D·c = b (coupled). `X_WL` must be the pose at which the sums were taken.
/// Real-time safe: yes.
void add_medium_drag(const SerialArm& arm, const LinkPoses& X_WL, const MediumLinkSums& sums, DragMode mode,
                     DragCoefficients& result) noexcept;

}  // namespace phantom::robot

#pragma once

#include <array>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include "common/core/clock.hpp"
#include "common/core/joints.hpp"
#include "common/fusion/depth_image.hpp"
#include "common/geometry/mesh/mesh.hpp"
#include "common/robot/kinematics/serial_arm.hpp"
#include "common/robot/skin/skin.hpp"
#include "common/workspace/grid.hpp"

namespace phantom::workspace_camera {

/// Where an arm was at a time.
struct ArmPose {
  core::JointArray q{};  ///< rad or m
  double closing = 0.0;  ///< share by which its gripper is closed, 0…1
};

/// The arm's poses of the last second or so. One thread puts, any asks. Allocates in the constructor only.
class ArmHistory {
 public:
  /// Times are of one monotonic clock, and rise.
  void put(core::Nanoseconds at_ns, const core::JointArray& q);
  void set_closing(double share);
  /// Returns the pose at a time, between the two poses around it; that of the newest for up to kAhead_ns
  /// after it. Nothing, if none is that near.
  std::optional<ArmPose> at(core::Nanoseconds time_ns) const;
  /// When the newest pose came; 0: none did.
  core::Nanoseconds newest_ns() const;

  static constexpr core::Nanoseconds kAhead_ns = 10 * core::kNsPerMillisecond;
  /// Greatest time between two poses around a time.
  static constexpr core::Nanoseconds kGap_ns = 100 * core::kNsPerMillisecond;

 private:
  struct Entry {
    core::Nanoseconds at_ns = 0;
    core::JointArray q{};
  };
  static constexpr std::size_t kEntries = 2048;
  mutable std::mutex mutex_;
  std::array<Entry, kEntries> entries_{};
  std::size_t count_ = 0;
  double closing_ = 0.0;
};

/// A mesh that moves with a link.
struct LinkPart {
  std::size_t link = 0;
  geometry::Pose X_LM;
  geometry::TriangleMesh mesh;
  Eigen::Vector3d closing_m = Eigen::Vector3d::Zero();  ///< its way in the link as the gripper closes
};

/// What of an arm is seen: the meshes of its links, its skin, and what it carries.
class ArmView {
 public:
  /// Loads the meshes. `closed`: the same arm with its gripper closed, if that moves. Throws
  /// core::ConfigError, core::MissingError.
  ArmView(robot::SerialArm arm, const std::optional<robot::SerialArm>& closed, robot::SkinLayout skin,
          double skin_pitch_m);

  const robot::SerialArm& arm() const { return arm_; }
  const std::vector<LinkPart>& parts() const { return parts_; }
  const std::vector<LinkPart>& carried() const { return carried_; }
  void set_carried(std::vector<LinkPart> carried) { carried_ = std::move(carried); }
  /// Returns the pose of a part in W.
  static geometry::Pose pose_of(const LinkPart& part, const robot::LinkPoses& X_WL, double closing);

  /// Draws the depth of the arm and what it carries for each pixel; 0: it is not there. Allocates only for
  /// more pixels than before.
  void draw(const ArmPose& pose, const fusion::PinholeCamera& camera, const geometry::Pose& X_WC,
            std::vector<float>& depth_m);
  /// Marks the blocks of 8³ voxels in which the arm or what it carries is, or which are within `margin_m` of
  /// its skin: `own` holds one for each of fusion::blocks_of(grid), by its index. Of what is carried its box
  /// along the axes of W counts.
  void mark_own(const ArmPose& pose, const workspace::GridSpec& grid, double margin_m,
                std::span<std::uint8_t> own) const;

 private:
  robot::SerialArm arm_;
  std::vector<LinkPart> parts_, carried_;
  robot::SkinLayout skin_;
  double skin_radius_m_;
  std::vector<Eigen::Vector3d> corners_m_;
};

}  // namespace phantom::workspace_camera

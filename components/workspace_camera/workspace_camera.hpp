#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/core/health.hpp"
#include "common/fusion/fusion.hpp"
#include "common/messages/living.hpp"
#include "components/workspace_camera/arm_view.hpp"
#include "components/workspace_camera/camera_watch.hpp"
#include "components/workspace_camera/config.hpp"

namespace phantom::workspace_camera {

/// An image of one of the configured cameras.
struct CameraImage {
  std::size_t camera = 0;  ///< its place in the configuration
  fusion::PinholeCamera pinhole;
  core::Nanoseconds exposed_ns = 0;  ///< by this host's monotonic clock
  std::span<const std::uint16_t> depth_mm;
};

/// Turns images into changes of occupancy: masks the arm at each image's own time, fuses, and says what has
/// changed since it was last asked. Watches the cameras. Knows no clock, file or DDS: equal inputs give equal
/// outputs. One thread.
class WorkspaceCamera {
 public:
  /// `arm`: null: no arm is masked. It and `history` must outlive this. Throws core::ConfigError.
  WorkspaceCamera(const WorkspaceCameraConfig& config, std::string source, std::string cell,
                  const workspace::GridSpec& grid, ArmView* arm, const ArmHistory& history);

  /// Fuses an image. Returns why not: a header that is none; where the arm was at the image's time is not
  /// known, so that it would be taken for matter; it is the same image as the one before.
  core::Status take(const CameraImage& image, core::Nanoseconds now_ns);
  /// Looks at the cameras' age; ends the matter of one that has died, if it is to end. Returns whether the
  /// state of one has changed.
  bool watch(core::Nanoseconds now_ns);

  /// Returns the blocks that changed since the last call. `whole`: all that are occupied.
  messages::OccupancyChange change(bool whole, core::Nanoseconds now_ns);
  /// Returns how long ago each part of the workspace was seen; where the arm is now does not count. Some
  /// milliseconds for 10⁶ blocks.
  messages::SpaceView space_view(core::Nanoseconds now_ns) const;
  bool has_changes() const { return !fusion_.changed_blocks().empty(); }

  /// Returns this component's state in one sentence, with figures.
  core::Health health(core::Nanoseconds now_ns) const;
  const fusion::Fusion& fusion() const { return fusion_; }
  /// Returns the newest image that was fused, and the arm's depth in it (ArmView).
  const fusion::DepthImage& image() const { return image_; }
  std::span<const float> arm_depth_m() const { return arm_depth_m_; }
  std::uint64_t fused_images() const { return fused_; }

 private:
  struct View {
    CameraConfig config;
    CameraWatch watch;
    std::size_t link = 0;
    geometry::Pose X_LF;  ///< of the link that it is mounted on, in the moving link's frame
    messages::DepthCameraState state = messages::DepthCameraState::kWaiting;
    std::optional<workspace::VoxelBox> seen;  ///< all that it has seen since it was last forgotten
  };

  core::Status refuse(core::Status why);
  geometry::Pose pose_of(const View& view, const ArmPose* pose) const;
  workspace::VoxelBox box_seen(const fusion::PinholeCamera& camera, const geometry::Pose& X_WC) const;
  messages::OccupancyBlock block_at(workspace::Index3 block) const;

  const WorkspaceCameraConfig config_;
  const std::string source_, cell_;
  ArmView* const arm_;
  const ArmHistory& history_;
  fusion::Fusion fusion_;
  std::vector<View> views_;
  workspace::VoxelBox blocks_;
  std::vector<std::uint8_t> occupied_;  // by blocks_.index(): a voxel of the block is
  fusion::DepthImage image_;
  std::vector<float> arm_depth_m_;
  core::Nanoseconds exposed_ns_ = 0;  // of the newest image fused since change(); 0: none
  std::uint64_t fused_ = 0, refused_ = 0;
  std::string why_refused_;
  core::Nanoseconds refused_ns_ = 0;
  fusion::FusionReport report_;
};

}  // namespace phantom::workspace_camera

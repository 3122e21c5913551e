#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "common/fusion/change_gate.hpp"
#include "common/fusion/depth_pyramid.hpp"
#include "common/fusion/fuse_kernel.hpp"
#include "common/fusion/fusion_parameters.hpp"

namespace phantom::fusion {

/// What a frame did.
struct FusionReport {
  std::size_t blocks = 0;     ///< with content, after the frame
  std::size_t fused = 0;      ///< blocks that the frame was fused into
  std::size_t quiet = 0;      ///< blocks in view that it was not, since nothing changes there
  std::size_t allocated = 0;  ///< blocks that got a content
  std::size_t released = 0;   ///< blocks without a surface near, which lost theirs
  std::size_t refused = 0;    ///< blocks that found no memory; the space there stays as it was
  ChangeGate::Settled changes;
};

/// Fuses depth images into a sparse truncated signed distance field of a grid, and publishes its occupancy
/// (Curless and Levoy 1996; blocks as Nießner et al. 2013). Distances are measured along the line of sight
/// and averaged over the last max_weight frames. A voxel forgets what it holds when a measurement deviates
/// from it by more than surprise_sigmas · σ and surprise_vox: something moved.
///
/// Not thread-safe. All memory is taken at construction, but for that of an image, which is taken with the
/// first image of its size.
class Fusion {
 public:
  /// Returns the error of check_parameters(), if there is one.
  static core::Expected<Fusion> create(const FusionParameters& parameters);

  const FusionParameters& parameters() const noexcept { return parameters_; }
  const workspace::GridSpec& grid() const noexcept { return parameters_.grid; }

  /// Fuses an image. `arm_depth_m`: empty, or for each pixel the depth of the arm with what it carries, at
  /// the image's time, in metres; 0: no arm there. Of another size it counts as empty. Its pixels within
  /// masks.arm_margin_m before the arm or behind it are not fused. Real-time safe: yes, after the first
  /// image.
  const FusionReport& integrate(const DepthImage& image, std::span<const float> arm_depth_m = {});

  /// The published occupancy, one bit for each voxel.
  const workspace::BitVolume& occupied() const noexcept { return gate_->published(); }
  /// The blocks of 8³ voxels whose occupancy changed since clear_changes(), each once.
  std::span<const workspace::Index3> changed_blocks() const noexcept { return gate_->changed_blocks(); }
  void clear_changes() noexcept { gate_->clear_changes(); }

  /// Makes the blocks that a box touches unknown; what is published of them follows their policy. For the
  /// space of a camera that died. Real-time safe: yes.
  void forget(const workspace::VoxelBox& box) noexcept;

  /// Returns the distance of a voxel's centre from the surface in voxels, along the lines of sight, positive
  /// in front; nothing is known if weight() is 0. `v` must lie in the grid.
  double distance_vox(workspace::Index3 v) const noexcept;
  int weight(workspace::Index3 v) const noexcept;
  /// Returns the share of a block's voxels that are known, 0…1. A block that was last seen empty as a whole
  /// counts as known.
  double coverage(workspace::Index3 block) const noexcept;
  /// Returns the time of the newest image in which at least a quarter of a block was seen, to 1/16 s;
  /// negative: it never was. Of a block in which no surface is near, one image in eight counts.
  double seen_s(workspace::Index3 block) const noexcept {
    return static_cast<double>(seen_at_[pool_->box().index(block)]) / kSeenSteps_per_s - 1.0;
  }
  UnknownPolicy policy(workspace::Index3 block) const noexcept {
    return policies_[pool_->box().index(block)];
  }
  /// Memory that grows with the grid and its blocks, without that of images.
  std::size_t bytes() const noexcept;

 private:
  explicit Fusion(const FusionParameters& parameters);

  static constexpr double kSeenSteps_per_s = 16.0;

  void set_view(const DepthImage& image);
  void allocate_near_surfaces() noexcept;
  void fuse_blocks() noexcept;
  void fuse(FusedBlock& block) noexcept;
  bool is_partly_seen(const Eigen::Vector3d& first_voxel) const noexcept;
  void look_through_free_blocks() noexcept;
  void see(std::size_t place) noexcept { seen_at_[place] = std::max(seen_at_[place], now_steps_); }
  /// Returns the first voxel of a block in the camera's frame, in voxels.
  Eigen::Vector3d first_voxel(workspace::Index3 block) const noexcept {
    return first_voxel_ + step_ * workspace::vector(block);
  }
  /// The depths around a block's image; none, if it is not in the image.
  struct BlockView {
    double z = 0.0;  ///< of the block's centre, in voxels
    DepthPyramid::Depths depths;
    int u0 = 0, v0 = 0, u1 = -1, v1 = -1;  ///< pixels around its image
  };
  BlockView view_of(const Eigen::Vector3d& first_voxel) const noexcept;

  FusionParameters parameters_;
  std::unique_ptr<BlockPool> pool_;
  std::unique_ptr<ChangeGate> gate_;
  std::vector<UnknownPolicy> policies_;  // by place in the directory
  std::vector<std::uint32_t>
      seen_free_;  // frame in which a block without content was last seen empty; 0: never
  std::uint32_t frame_ = 0;
  std::vector<std::uint32_t> seen_at_;  // by place: 1 s and the image's time, in steps; 0: never
  std::uint32_t now_steps_ = 0;         // of this image

  PreparedDepth depth_;
  DepthPyramid pyramid_;
  CameraHistory history_;
  PinholeCamera camera_;
  Eigen::Vector3d first_voxel_, centre_;  // of block 0 in C; from a block's first voxel to its centre
  Eigen::Matrix3d step_;                  // from block to block in C
  std::unique_ptr<detail::FrameView> view_;
  detail::RayView rays_;
  std::vector<std::int32_t> missing_;
  FusionReport report_;
};

}  // namespace phantom::fusion

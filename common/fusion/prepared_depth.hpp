#pragma once

#include <array>
#include <span>
#include <vector>

#include "common/fusion/depth_image.hpp"

namespace phantom::fusion {

/// Which pixels are not fused.
struct MaskParameters {
  /// Neighbours that differ by more than edge_m + edge_sigmas · σ are an edge. What lies behind it is not
  /// fused, since pixels between two surfaces measure neither; nor is a pixel that is alone in front. What is
  /// at most four pixels wide is made wider by one at each side, so that no voxel falls beside it.
  double edge_m = 0.02;
  double edge_sigmas = 6.0;
  /// A pixel that sees the arm, or anything behind the place where the arm is, belongs to the arm: it says
  /// that there is nothing before the arm and this margin.
  double arm_margin_m = 0.03;
  int arm_margin_px = 2;
};

/// A depth image in voxels, with its masks. Keeps its memory from frame to frame.
class PreparedDepth {
 public:
  /// Prepares an image. `arm_depth_m`: empty, or for each pixel the depth of the arm, with what it carries,
  /// at the image's time; 0: no arm there. Allocates only for more pixels than before.
  void prepare(const DepthImage& image, std::span<const float> arm_depth_m, const DepthSigma& sigma,
               const MaskParameters& masks, double voxel_size_m);

  int width() const noexcept { return width_; }
  int height() const noexcept { return height_; }
  /// Depths in voxels that are fused; 0: none; −d: of the arm, and nothing is nearer than d. Rows of width().
  /// The element before the first one is 0.
  std::span<const float> fused_vox() const noexcept { return {fused_.data() + 1, pixels()}; }
  const float* fused_row(int v) const noexcept {
    return fused_.data() + 1 + static_cast<std::size_t>(v) * static_cast<std::size_t>(width_);
  }
  /// The same with edges. Row v begins at row(v).
  const float* row(int v) const noexcept {
    return seen_.data() + first_ + static_cast<std::size_t>(v) * stride_;
  }

 private:
  std::size_t pixels() const noexcept {
    return static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_);
  }
  float* fused_row(int v) noexcept {
    return fused_.data() + 1 + static_cast<std::size_t>(v) * static_cast<std::size_t>(width_);
  }
  void resize(const PinholeCamera& camera);
  void grow_arm(std::span<const float> arm_depth_m, const MaskParameters& masks);
  void fill_beside_thin(float offset, float slope);

  int width_ = 0, height_ = 0;
  std::size_t stride_ = 0, first_ = 0;  // of seen_: of its rows, and of its first pixel
  std::vector<float> seen_;             // with a border of 0
  std::vector<float> fused_;
  std::array<std::vector<float>, 2>
      kept_;                       // two rows, with a border of 0, as they were before they are filled
  std::vector<float> arm_, rows_;  // least depth of the arm near each pixel, and along its row
};

}  // namespace phantom::fusion

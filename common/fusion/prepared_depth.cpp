#include "common/fusion/prepared_depth.hpp"

#include <algorithm>
#include <cmath>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "common/fusion/prepared_depth.cpp"
#include <hwy/foreach_target.h>  // compiled once for each instruction set
// foreach_target.h must come before highway.h.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace phantom::fusion::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// Copies a row without the pixels behind an edge. `centre` has neighbours before and after it, and at
/// ±stride. Pixels differ if they are more than `offset` + `slope` · depth² apart. A pixel is left out if a
/// neighbour is nearer and differs, or if one is farther and differs and none is like it.
void RowWithoutEdges(const float* centre, std::size_t stride, std::size_t width, float offset, float slope,
                     float* to) {
  const hn::ScalableTag<float> d;
  const std::size_t lanes = hn::Lanes(d);
  const auto zero = hn::Zero(d), base = hn::Set(d, offset), square = hn::Set(d, slope);
  const auto put = [&](std::size_t x) HWY_ATTR {
    const auto here = hn::LoadU(d, centre + x);
    const auto limit = hn::MulAdd(square, hn::Mul(here, here), base);
    auto nearer = hn::Lt(zero, zero), farther = nearer, alike = nearer;  // none
    for (const float* neighbour :
         {centre + x - 1, centre + x + 1, centre + x - stride, centre + x + stride}) {
      const auto other = hn::LoadU(d, neighbour);
      const auto valid = hn::Gt(other, zero);
      const auto before = hn::Gt(hn::Sub(here, other), limit), behind = hn::Gt(hn::Sub(other, here), limit);
      nearer = hn::Or(nearer, hn::And(valid, before));
      farther = hn::Or(farther, hn::And(valid, behind));
      alike = hn::Or(alike, hn::AndNot(hn::Or(before, behind), valid));
    }
    const auto edge = hn::Or(nearer, hn::AndNot(alike, farther));
    hn::StoreU(hn::IfThenZeroElse(edge, here), d, to + x);
  };
  std::size_t x = 0;
  for (; x + lanes <= width; x += lanes) put(x);
  if (x < width && width >= lanes) {
    put(width - lanes);
  } else {
    for (; x < width; ++x) {
      const float here = centre[x], limit = slope * here * here + offset;
      bool nearer = false, farther = false, alike = false;
      for (const float* other : {centre + x - 1, centre + x + 1, centre + x - stride, centre + x + stride}) {
        if (*other <= 0.0F) continue;
        nearer = nearer || here - *other > limit;
        farther = farther || *other - here > limit;
        alike = alike || std::abs(*other - here) <= limit;
      }
      to[x] = nearer || (farther && !alike) ? 0.0F : here;
    }
  }
}

}  // namespace phantom::fusion::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace phantom::fusion {

HWY_EXPORT(RowWithoutEdges);

namespace {
constexpr float kNoArm = 1e9F;
}

void PreparedDepth::grow_arm(std::span<const float> arm_depth_m, const MaskParameters& masks) {
  arm_.resize(std::max(arm_.size(), pixels()));
  rows_.resize(std::max(rows_.size(), pixels()));
  const auto width = static_cast<std::size_t>(width_), height = static_cast<std::size_t>(height_),
             margin = static_cast<std::size_t>(masks.arm_margin_px);
  for (std::size_t i = 0; i < pixels(); ++i) arm_[i] = arm_depth_m[i] > 0.0F ? arm_depth_m[i] : kNoArm;
  for (std::size_t v = 0; v < height; ++v) {
    const float* const from = arm_.data() + v * width;
    for (std::size_t u = 0; u < width; ++u) {
      const std::size_t first = u - std::min(u, margin), last = std::min(width - 1, u + margin);
      rows_[v * width + u] = *std::min_element(from + first, from + last + 1);
    }
  }
  for (std::size_t v = 0; v < height; ++v) {
    float* const to = arm_.data() + v * width;
    std::fill(to, to + width, kNoArm);
    for (std::size_t row = v - std::min(v, margin); row <= std::min(height - 1, v + margin); ++row) {
      const float* const from = rows_.data() + row * width;
      for (std::size_t u = 0; u < width; ++u) to[u] = std::min(to[u], from[u]);
    }
  }
}

void PreparedDepth::prepare(const DepthImage& image, std::span<const float> arm_depth_m,
                            const DepthSigma& sigma, const MaskParameters& masks, double voxel_size_m) {
  width_ = image.camera().width_px;
  height_ = image.camera().height_px;
  const auto width = static_cast<std::size_t>(width_);
  seen_.resize(std::max(seen_.size(), stride() * (static_cast<std::size_t>(height_) + 2)));
  fused_.resize(std::max(fused_.size(), pixels() + 1));
  const bool has_arm = arm_depth_m.size() == pixels();
  if (has_arm) grow_arm(arm_depth_m, masks);
  const auto to_voxels = static_cast<float>(1.0 / voxel_size_m),
             margin_m = static_cast<float>(masks.arm_margin_m);
  std::fill_n(seen_.begin(), stride(), 0.0F);
  for (std::size_t v = 0; v < static_cast<std::size_t>(height_); ++v) {
    const float* const from = image.depth_m().data() + v * width;
    float* const to = seen_.data() + (v + 1) * stride() + 1;
    to[-1] = to[width] = 0.0F;
    if (has_arm) {
      const float* const arm = arm_.data() + v * width;
      for (std::size_t u = 0; u < width; ++u)
        to[u] = from[u] >= arm[u] - margin_m ? 0.0F : to_voxels * from[u];
    } else {
      for (std::size_t u = 0; u < width; ++u) to[u] = to_voxels * from[u];
    }
  }
  std::fill_n(seen_.begin() + static_cast<std::ptrdiff_t>((static_cast<std::size_t>(height_) + 1) * stride()),
              stride(), 0.0F);
  const auto offset = static_cast<float>(masks.edge_m / voxel_size_m),
             slope = static_cast<float>(masks.edge_sigmas * sigma.at_1m_m * voxel_size_m);
  for (int v = 0; v < height_; ++v) HWY_DYNAMIC_DISPATCH(RowWithoutEdges)
  (row(v), stride(), width, offset, slope, fused_.data() + 1 + static_cast<std::size_t>(v) * width);
}

}  // namespace phantom::fusion
#endif  // HWY_ONCE

#include "common/fusion/prepared_depth.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "common/fusion/prepared_depth.cpp"
#include <hwy/foreach_target.h>  // compiled once for each instruction set
// foreach_target.h must come before highway.h.
#include <hwy/highway.h>

#ifndef PHANTOM_FUSION_THIN_PX
#define PHANTOM_FUSION_THIN_PX
namespace phantom::fusion {
constexpr int kThin_px = 4;            // what is thinner is widened by a pixel
constexpr std::size_t kMaxLanes = 16;  // of a vector
constexpr std::size_t kBorder = 24;    // of 0 around an image: a vector beside its last pixel, and kThin_px

/// The rows around one row: depths without edges, and depths with them.
struct RowsAround {
  const float *before, *here, *after;  // without edges; `here` has a border
  const float* seen;                   // with edges and a border, rows `stride` apart
  std::size_t stride;
  float offset, slope;  // as of RowWithoutEdges()
};
}  // namespace phantom::fusion
#endif

HWY_BEFORE_NAMESPACE();
namespace phantom::fusion::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// Copies a row without the pixels behind an edge. `centre` has neighbours before and after it, and at
/// ±stride. Pixels differ if they are more than `offset` + `slope` · depth² apart. A pixel is left out if a
/// neighbour is nearer and differs, or if one is farther and differs and fewer than two are like it, within
/// half of that: of two flying pixels side by side each may be like the other. A pixel of the arm, below 0,
/// is no neighbour, and is left out behind an edge only.
void RowWithoutEdges(const float* centre, std::size_t stride, std::size_t width, float offset, float slope,
                     float* to) {
  const hn::ScalableTag<float> d;
  const std::size_t lanes = hn::Lanes(d);
  const auto zero = hn::Zero(d), base = hn::Set(d, offset), square = hn::Set(d, slope),
             half = hn::Set(d, 0.5F);
  const auto put = [&](std::size_t x) HWY_ATTR {
    const auto given = hn::LoadU(d, centre + x), here = hn::Abs(given);
    const auto limit = hn::MulAdd(square, hn::Mul(here, here), base), close = hn::Mul(limit, half);
    auto nearer = hn::Lt(zero, zero), farther = nearer, alike = nearer, supported = nearer;  // none
    for (const float* neighbour :
         {centre + x - 1, centre + x + 1, centre + x - stride, centre + x + stride}) {
      const auto other = hn::LoadU(d, neighbour);
      const auto valid = hn::Gt(other, zero);
      const auto before = hn::Gt(hn::Sub(here, other), limit), behind = hn::Gt(hn::Sub(other, here), limit);
      nearer = hn::Or(nearer, hn::And(valid, before));
      farther = hn::Or(farther, hn::And(valid, behind));
      const auto one = hn::And(valid, hn::Le(hn::Abs(hn::Sub(here, other)), close));
      supported = hn::Or(supported, hn::And(alike, one));
      alike = hn::Or(alike, one);
    }
    const auto lonely = hn::And(hn::Gt(given, zero), hn::AndNot(supported, farther));
    hn::StoreU(hn::IfThenZeroElse(hn::Or(nearer, lonely), given), d, to + x);
  };
  std::size_t x = 0;
  for (; x + lanes <= width; x += lanes) put(x);
  if (x < width && width >= lanes) {
    put(width - lanes);
  } else {
    for (; x < width; ++x) {
      const float here = std::abs(centre[x]), limit = slope * here * here + offset;
      bool nearer = false, farther = false;
      int alike = 0;
      for (const float* other : {centre + x - 1, centre + x + 1, centre + x - stride, centre + x + stride}) {
        if (*other <= 0.0F) continue;
        nearer = nearer || here - *other > limit;
        farther = farther || *other - here > limit;
        alike += std::abs(*other - here) <= 0.5F * limit ? 1 : 0;
      }
      to[x] = nearer || (centre[x] > 0.0F && farther && alike < 2) ? 0.0F : centre[x];
    }
  }
}

/// Gives pixels that are left out the depth of what is thin beside them: of a neighbour whose surface ends
/// within kThin_px. Writes the row to `to`. Pixels of the arm, below 0 in `seen`, stay left out.
void FillBesideThin(const RowsAround& rows, std::size_t width, float* to) {
  const hn::CappedTag<float, kMaxLanes> d;
  const auto zero = hn::Zero(d), none = hn::Set(d, 1e9F), base = hn::Set(d, rows.offset),
             square = hn::Set(d, rows.slope);
  const auto step = static_cast<std::ptrdiff_t>(rows.stride);
  for (std::size_t x = 0; x < width; x += hn::Lanes(d)) {
    const auto here = hn::LoadU(d, rows.here + x);
    const float* const seen = rows.seen + x;
    const auto open = hn::And(hn::Eq(here, zero), hn::Ge(hn::LoadU(d, seen), zero));
    auto filled = none;
    if (!hn::AllFalse(d, open)) {
      const auto look = [&](const float* neighbour, std::ptrdiff_t away) HWY_ATTR {
        const auto near = hn::LoadU(d, neighbour);
        const auto beyond = hn::Add(near, hn::MulAdd(square, hn::Mul(near, near), base));
        auto ends = hn::Lt(zero, zero);
        for (int k = 2; k <= kThin_px + 1; ++k)
          ends = hn::Or(ends, hn::Gt(hn::LoadU(d, seen + k * away), beyond));
        const auto thin = hn::And(hn::Gt(near, zero), ends);
        filled = hn::IfThenElse(thin, hn::Min(filled, near), filled);
      };
      look(rows.here + x - 1, -1);
      look(rows.here + x + 1, 1);
      look(rows.before + x, -step);
      look(rows.after + x, step);
    }
    const auto fills = hn::And(open, hn::Lt(filled, none));
    hn::BlendedStore(hn::IfThenElse(fills, filled, here), hn::FirstN(d, width - x), d, to + x);
  }
}

}  // namespace phantom::fusion::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace phantom::fusion {

HWY_EXPORT(RowWithoutEdges);
HWY_EXPORT(FillBesideThin);

namespace {
constexpr float kNoArm = 1e9F;
constexpr float kNothingFree_vox = 1e-3F;  // before an arm that is at the camera
}  // namespace

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

void PreparedDepth::resize(const PinholeCamera& camera) {
  if (width_ == camera.width_px && height_ == camera.height_px) return;
  width_ = camera.width_px;
  height_ = camera.height_px;
  const std::size_t width = static_cast<std::size_t>(width_);
  stride_ = width + 2 * kBorder;
  first_ = kBorder * stride_ + kBorder;
  // The border is 0 from here on.
  seen_.assign(stride_ * (static_cast<std::size_t>(height_) + 2 * kBorder), 0.0F);
  fused_.assign(1 + pixels() + kMaxLanes, 0.0F);
  for (std::vector<float>& row : kept_) row.assign(width + 2 * kBorder, 0.0F);
}

void PreparedDepth::prepare(const DepthImage& image, std::span<const float> arm_depth_m,
                            const DepthSigma& sigma, const MaskParameters& masks, double voxel_size_m) {
  resize(image.camera());
  const auto width = static_cast<std::size_t>(width_), height = static_cast<std::size_t>(height_);
  const bool has_arm = arm_depth_m.size() == pixels();
  if (has_arm) grow_arm(arm_depth_m, masks);
  const auto to_voxels = static_cast<float>(1.0 / voxel_size_m),
             margin_m = static_cast<float>(masks.arm_margin_m);
  for (std::size_t v = 0; v < height; ++v) {
    const float* const from = image.depth_m().data() + v * width;
    float* const to = seen_.data() + first_ + v * stride_;
    if (has_arm) {
      const float* const arm = arm_.data() + v * width;
      for (std::size_t u = 0; u < width; ++u) {
        const float free_m = arm[u] - margin_m;
        to[u] = from[u] == 0.0F || from[u] < free_m ? to_voxels * from[u]
                                                    : -std::max(to_voxels * free_m, kNothingFree_vox);
      }
    } else {
      for (std::size_t u = 0; u < width; ++u) to[u] = to_voxels * from[u];
    }
  }
  const auto offset = static_cast<float>(masks.edge_m / voxel_size_m),
             slope = static_cast<float>(masks.edge_sigmas * sigma.at_1m_m * voxel_size_m);
  for (int v = 0; v < height_; ++v)
    HWY_DYNAMIC_DISPATCH(RowWithoutEdges)(row(v), stride_, width, offset, slope, fused_row(v));
  fill_beside_thin(offset, slope);
}

/// Widens what is thin. Each row is filled from rows as they were before.
void PreparedDepth::fill_beside_thin(float offset, float slope) {
  const auto width = static_cast<std::size_t>(width_);
  std::fill(kept_[0].begin(), kept_[0].end(), 0.0F);  // before the first row
  std::size_t now = 1;
  for (int v = 0; v < height_; ++v, now ^= 1) {
    float* const here = kept_[now].data() + kBorder;
    std::copy_n(fused_row(v), width, here);
    const float* const after = v + 1 < height_ ? fused_row(v + 1) : seen_.data();
    HWY_DYNAMIC_DISPATCH(FillBesideThin)
    ({kept_[now ^ 1].data() + kBorder, here, after, row(v), stride_, offset, slope}, width, fused_row(v));
  }
}

}  // namespace phantom::fusion
#endif  // HWY_ONCE

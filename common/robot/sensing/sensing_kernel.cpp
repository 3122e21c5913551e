// Compiled once for each instruction set by Highway's foreach_target; the best one is chosen at run time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "common/robot/sensing/sensing_kernel.cpp"
#include "common/robot/sensing/sensing_kernel.hpp"

#include <hwy/foreach_target.h>  // must come before highway.h
#include <hwy/highway.h>

#include "common/robot/sensing/sensing_lanes-inl.hpp"
#include "common/robot/sensing/sensing_near-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace phantom::robot::kernel::HWY_NAMESPACE {

void LookUp(const Field& field, const ToVoxels& to, const Points& points, std::uint8_t* codes,
            std::uint32_t* voxels) {
  const Ints di;
  for (std::size_t i = 0; i < points.count; i += lanes()) {
    const Indices at = indices(to, points, i);
    store_codes(codes_of(field, at), codes + i);
    if (voxels == nullptr) continue;
    const VI low = hn::Set(di, 1023);
    const VI folded = hn::Or(hn::Or(hn::And(at.x, low), hn::ShiftLeft<10>(hn::And(at.y, low))),
                             hn::ShiftLeft<20>(hn::And(at.z, low)));
    hn::StoreU(hn::BitCast(Words(), folded), Words(), voxels + i);
  }
}

void AddMoments(const Points& points, const double* mu, Moments& moments) {
  const Doubles d;
  const std::size_t half = hn::Lanes(d);
  SpatialInertiaSums sums;
  for (std::size_t i = 0; i < points.count; i += half) add_points(points, i, hn::LoadU(d, mu + i), sums);
  sums.take(moments.sum);
}

void Sense(const Field& field, const ToVoxels& to, const Points& points, const Offsets& offsets,
           const float* palette, std::size_t palette_size, std::uint8_t* codes, Moments& moments) {
  // Each block is processed in two passes. A pass keeps all it needs in registers, and the block stays in the
  // L1 cache.
  const Ints di;
  const Doubles d;
  const hn::Rebind<std::uint8_t, Ints> bytes;
  const std::size_t half = hn::Lanes(d);
  Near near(to);
  with_palette(palette, palette_size, [&](const auto& mu_of) HWY_ATTR {
    SpatialInertiaSums sums;
    const auto add_all = [&](std::size_t first, std::size_t end, const auto& add) HWY_ATTR {
      for (std::size_t i = first; i < end; i += lanes()) {
        const VI code = hn::PromoteTo(di, hn::LoadU(bytes, codes + i));
        if (hn::AllTrue(di, hn::Eq(code, hn::Zero(di)))) continue;
        const auto mu = mu_of(code);
        add(i, promote_low(mu));
        add(i + half, promote_high(mu));
      }
    };
    const Block* block = offsets.blocks;
    for (std::size_t first = 0; first < points.count; first += kBlock, ++block) {
      const std::size_t end = first + kBlock < points.count ? first + kBlock : points.count;
      if (!near.place(field, to, *block)) {
        for (std::size_t i = first; i < end; i += lanes())
          store_codes(codes_of(field, indices(to, points, i)), codes + i);
        add_all(first, end, [&](std::size_t i, VD mu) HWY_ATTR { add_points(points, i, mu, sums); });
        continue;
      }
      near.look_up(field, to, points, offsets, first, end, codes);
      SpatialInertiaSums part;
      if (block->weight < 0.0) {
        add_all(first, end, [&](std::size_t i, VD mu) HWY_ATTR {
          add_steps(offsets, i, hn::Mul(mu, hn::LoadU(d, points.weight + i)), part);
        });
      } else {
        add_all(first, end, [&](std::size_t i, VD mu) HWY_ATTR { add_steps(offsets, i, mu, part); });
      }
      add_block(*block, part, sums);
    }
    sums.take(moments.sum);
  });
}

/// Running sums of GradientSums.
struct SlopeSums {
  VD s[7];

  HWY_INLINE SlopeSums() {
    for (VD& v : s) v = hn::Zero(Doubles());
  }
  /// Adds one vector of points. `r`: rotation to W in reference lengths. `step`: for each axis, μ at +reach
  /// minus μ at −reach, divided by the stretch. `met`: the palette's μ,
  /// 0 for points that do not count.
  HWY_INLINE void add(const double* r, const Points& points, std::size_t i, const VD step[3], VD met, VD mu) {
    const Doubles d;
    const VD x = hn::LoadU(d, points.x_m + i), y = hn::LoadU(d, points.y_m + i),
             z = hn::LoadU(d, points.z_m + i);
    const VD rx = coordinate(r, 0.0, x, y, z), ry = coordinate(r + 3, 0.0, x, y, z),
             rz = coordinate(r + 6, 0.0, x, y, z);
    const auto counts = hn::Gt(met, hn::Zero(d));
    const VD w = hn::IfThenElseZero(counts, hn::LoadU(d, points.weight + i));
    const VD gx = hn::Mul(w, step[0]), gy = hn::Mul(w, step[1]), gz = hn::Mul(w, step[2]);
    s[0] = hn::Add(s[0], gx);
    s[1] = hn::Add(s[1], gy);
    s[2] = hn::Add(s[2], gz);
    s[3] = hn::Add(s[3], hn::Sub(hn::Mul(ry, gz), hn::Mul(rz, gy)));
    s[4] = hn::Add(s[4], hn::Sub(hn::Mul(rz, gx), hn::Mul(rx, gz)));
    s[5] = hn::Add(s[5], hn::Sub(hn::Mul(rx, gy), hn::Mul(ry, gx)));
    const VD square = hn::MulAdd(gx, step[0], hn::MulAdd(gy, step[1], hn::Mul(gz, step[2])));
    s[6] = hn::Add(s[6], hn::Div(square, hn::IfThenElse(counts, mu, hn::Set(d, 1.0))));
  }
};

void AddGradients(const Field& field, const ToVoxels& to, const Points& points, const float* palette,
                  std::size_t palette_size, const std::uint8_t* codes, const double* given_mu, int reach_vox,
                  GradientSums& out) {
  const Ints di;
  const Doubles d;
  const hn::Rebind<std::uint8_t, Ints> bytes;
  const std::size_t half = hn::Lanes(d);
  const VI reach = hn::Set(di, reach_vox);
  double r[9], per_step[3];
  for (int k = 0; k < 9; ++k) r[k] = to.r[k] * to.stretch[k / 3];
  for (int k = 0; k < 3; ++k) per_step[k] = 1.0 / to.stretch[k];
  with_palette(palette, palette_size, [&](const auto& mu_at) HWY_ATTR {
    SlopeSums sums;
    for (std::size_t i = 0; i < points.count; i += lanes()) {
      const VI code = hn::PromoteTo(di, hn::LoadU(bytes, codes + i));
      if (hn::AllTrue(di, hn::Eq(code, hn::Zero(di)))) continue;
      const Indices at = indices(to, points, i);
      const AlongAxis x = along_axis<0>(field, at.x), y = along_axis<1>(field, at.y),
                      z = along_axis<2>(field, at.z);
      const VW shift = byte_shift_of(at.x);
      const VI x_up = hn::Add(at.x, reach), x_down = hn::Sub(at.x, reach);
      const hn::Vec<Floats> up[3] = {
          mu_at(codes_at(field, along_axis<0>(field, x_up), y, z, byte_shift_of(x_up))),
          mu_at(codes_at(field, x, along_axis<1>(field, hn::Add(at.y, reach)), z, shift)),
          mu_at(codes_at(field, x, y, along_axis<2>(field, hn::Add(at.z, reach)), shift))};
      const hn::Vec<Floats> down[3] = {
          mu_at(codes_at(field, along_axis<0>(field, x_down), y, z, byte_shift_of(x_down))),
          mu_at(codes_at(field, x, along_axis<1>(field, hn::Sub(at.y, reach)), z, shift)),
          mu_at(codes_at(field, x, y, along_axis<2>(field, hn::Sub(at.z, reach)), shift))};
      VD low[3], high[3];
      for (int axis = 0; axis < 3; ++axis) {
        const VD per = hn::Set(d, per_step[axis]);
        low[axis] = hn::Mul(per, hn::Sub(promote_low(up[axis]), promote_low(down[axis])));
        high[axis] = hn::Mul(per, hn::Sub(promote_high(up[axis]), promote_high(down[axis])));
      }
      const auto met = mu_at(code);
      const VD met_low = promote_low(met), met_high = promote_high(met);
      sums.add(r, points, i, low, met_low, given_mu != nullptr ? hn::LoadU(d, given_mu + i) : met_low);
      sums.add(r, points, i + half, high, met_high,
               given_mu != nullptr ? hn::LoadU(d, given_mu + i + half) : met_high);
    }
    const double per_vox = 1.0 / (2.0 * reach_vox);
    for (std::size_t k = 0; k < 7; ++k)
      out.sum[k] += (k < 6 ? per_vox : per_vox * per_vox) * hn::GetLane(hn::SumOfLanes(d, sums.s[k]));
  });
}

const char* Target() { return hwy::TargetName(HWY_TARGET); }

}  // namespace phantom::robot::kernel::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace phantom::robot::kernel {

HWY_EXPORT(LookUp);
HWY_EXPORT(AddMoments);
HWY_EXPORT(Sense);
HWY_EXPORT(AddGradients);
HWY_EXPORT(Target);

Field field_of(const workspace::Workspace& workspace) noexcept {
  const auto& size = workspace.grid().size_vox;
  const auto& bricks = workspace.size_bricks();
  return {workspace.directory(),
          workspace.codes(),
          {size[0], size[1], size[2]},
          {bricks[0], bricks[1], bricks[2]}};
}

void look_up(const Field& field, const ToVoxels& to_voxels, const Points& points, std::uint8_t* codes,
             std::uint32_t* voxels) noexcept {
  HWY_DYNAMIC_DISPATCH(LookUp)(field, to_voxels, points, codes, voxels);
}

void add_moments(const Points& points, const double* mu, Moments& moments) noexcept {
  HWY_DYNAMIC_DISPATCH(AddMoments)(points, mu, moments);
}

void sense(const Field& field, const ToVoxels& to_voxels, const Points& points, const Offsets& offsets,
           const float* palette, std::size_t palette_size, std::uint8_t* codes, Moments& moments) noexcept {
  HWY_DYNAMIC_DISPATCH(Sense)(field, to_voxels, points, offsets, palette, palette_size, codes, moments);
}

void add_gradients(const Field& field, const ToVoxels& to_voxels, const Points& points, const float* palette,
                   std::size_t palette_size, const std::uint8_t* codes, const double* mu, int reach_vox,
                   GradientSums& sums) noexcept {
  HWY_DYNAMIC_DISPATCH(AddGradients)
  (field, to_voxels, points, palette, palette_size, codes, mu, reach_vox, sums);
}

const char* target_name() noexcept { return HWY_DYNAMIC_DISPATCH(Target)(); }

}  // namespace phantom::robot::kernel
#endif  // HWY_ONCE

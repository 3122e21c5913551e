#include "common/fusion/fuse_kernel.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "common/fusion/fuse_kernel.cpp"
#include <hwy/foreach_target.h>  // compiled once for each instruction set
// foreach_target.h must come before highway.h.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace phantom::fusion::detail::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::CappedTag<float, 16>;
using Ints = hn::RebindToSigned<Floats>;
constexpr Floats kFloats;
constexpr Ints kInts;
constexpr hn::Rebind<std::int16_t, Floats> kShorts;
constexpr hn::Rebind<std::uint8_t, Floats> kBytes;
using Vector = hn::Vec<Floats>;
using Mask = hn::Mask<Floats>;

/// Writes a vector's bits, from voxel `at` on. Later vectors may overwrite what it writes beyond them.
HWY_INLINE void put_bits(Mask mask, std::size_t at, BlockBits& bits) {
  auto* const bytes = reinterpret_cast<std::uint8_t*>(bits.data());
  if (hn::Lanes(kFloats) >= 8) {
    hn::StoreMaskBits(kFloats, mask, bytes + at / 8);
  } else {
    std::uint8_t few[8] = {};
    hn::StoreMaskBits(kFloats, mask, few);
    bytes[at / 8] = static_cast<std::uint8_t>(bytes[at / 8] | few[0] << (at % 8));
  }
}

/// Returns 1/x to 22 bits.
HWY_INLINE Vector reciprocal(Vector x) {
  const auto rough = hn::ApproximateReciprocal(x);
  return hn::Mul(rough, hn::NegMulAdd(x, rough, hn::Set(kFloats, 2.0F)));
}

/// Constants of a frame in vectors.
struct Rules {
  explicit HWY_INLINE Rules(const FuseRules& r)
      : truncation(hn::Set(kFloats, r.truncation)),
        saturated(hn::Set(kFloats, kSaturated * r.truncation)),
        surprise(hn::Set(kFloats, r.surprise)),
        saturated_surprise(hn::Set(kFloats, kSaturatedSurprise * r.truncation)),
        sigmas(hn::Set(kFloats, r.surprise_sigmas * r.sigma)),
        sigma(hn::Set(kFloats, r.sigma)),
        hysteresis(hn::Set(kFloats, r.hysteresis)),
        shell(hn::Set(kFloats, -r.shell)),
        max_weight(hn::Set(kFloats, r.max_weight)),
        last_decision(hn::Set(kFloats, r.max_weight - kDecisionFrames)),
        decision(hn::Set(kFloats, 1.0F / (r.decision_sigma * r.decision_sigma))) {}

  Vector truncation, saturated, surprise, saturated_surprise, sigmas, sigma, hysteresis, shell, max_weight,
      last_decision, decision;
};

/// Returns which voxels are to forget what they hold. `raw`: what the frame measures, not truncated.
HWY_INLINE Mask surprised(const Rules& rules, Vector depth, Vector raw, Vector measured, Vector held) {
  const auto saturated = hn::Ge(held, rules.saturated);
  const auto deviation = hn::Abs(hn::Sub(hn::IfThenElse(saturated, measured, raw), held));
  auto limit = hn::Mul(rules.sigmas, hn::Mul(depth, depth));
  limit = hn::IfThenElse(saturated, hn::Min(limit, rules.saturated_surprise), limit);
  return hn::Gt(deviation, hn::Max(limit, rules.surprise));
}

/// Returns by how much a surface must have passed the centres. `weight`: with this frame.
HWY_INLINE Vector dead_band(const Rules& rules, Vector sigma, Vector weight) {
  const auto enough = hn::Min(hn::Mul(rules.decision, hn::Mul(sigma, sigma)), rules.last_decision);
  const auto decides =
      hn::And(hn::Ge(weight, enough), hn::Lt(weight, hn::Add(enough, hn::Set(kFloats, kDecisionFrames))));
  return hn::IfThenZeroElse(decides, rules.hysteresis);
}

/// Adds the votes of a vector of voxels from `at` on.
HWY_INLINE void put_votes(const Rules& rules, Mask observed, Vector fused, Vector band, std::size_t at,
                          BlockVotes& votes) {
  put_bits(observed, at, votes.observed);
  put_bits(hn::And(observed, hn::Gt(fused, band)), at, votes.in_front);
  const auto in_shell = hn::Gt(fused, hn::Add(rules.shell, band));
  put_bits(hn::And(observed, hn::And(hn::Lt(fused, hn::Neg(band)), in_shell)), at, votes.occupied);
  put_bits(hn::And(observed, hn::Lt(fused, hn::Sub(rules.shell, band))), at, votes.behind);
  put_bits(hn::And(observed, hn::Ge(fused, rules.saturated)), at, votes.saturated);
}

/// The depths of the pixels that a block's voxels fall on. Looked up one by one: the gather
/// instructions of many processors are slower.
struct BlockDepths {
  alignas(64) float depth[kBlockVoxels];
};

/// Looks up the depths of all voxels of a block.
void look_up_depths(const FrameView& frame, float u, float v, float z, BlockDepths& depths) {
  const auto first_u = hn::Set(kFloats, u), first_v = hn::Set(kFloats, v), first_z = hn::Set(kFloats, z),
             min_z = hn::Set(kFloats, frame.min_z);
  const auto width = hn::Set(kInts, frame.width), height = hn::Set(kInts, frame.height),
             below = hn::Set(kInts, -1);
  alignas(64) std::int32_t pixels[kBlockVoxels];
  for (std::size_t i = 0; i < kBlockVoxels; i += hn::Lanes(kFloats)) {
    const auto depth_of_voxel = hn::Add(first_z, hn::Load(kFloats, frame.dz.data() + i));
    const auto inverse = reciprocal(depth_of_voxel);
    const auto column =
        hn::NearestInt(hn::Mul(hn::Add(first_u, hn::Load(kFloats, frame.du.data() + i)), inverse));
    const auto row =
        hn::NearestInt(hn::Mul(hn::Add(first_v, hn::Load(kFloats, frame.dv.data() + i)), inverse));
    const auto in_image = hn::And(hn::And(hn::Gt(column, below), hn::Lt(column, width)),
                                  hn::And(hn::Gt(row, below), hn::Lt(row, height)));
    const auto inside = hn::And(in_image, hn::RebindMask(kInts, hn::Gt(depth_of_voxel, min_z)));
    // The element before the first pixel holds 0.
    hn::Store(hn::IfThenElse(inside, hn::Add(hn::Mul(row, width), column), below), kInts, pixels + i);
  }
  for (std::size_t i = 0; i < kBlockVoxels; ++i) depths.depth[i] = frame.depth[pixels[i]];
}

void FuseBlock(const FrameView& frame, float u, float v, float z, FusedBlock& block, BlockVotes& votes) {
  votes = {};
  BlockDepths depths;
  look_up_depths(frame, u, v, z, depths);
  const Rules rules(frame.rules);
  const auto first_z = hn::Set(kFloats, z), one = hn::Set(kFloats, 1.0F),
             to_steps = hn::Set(kFloats, static_cast<float>(kDistanceSteps)),
             from_steps = hn::Set(kFloats, static_cast<float>(1.0 / kDistanceSteps));
  for (std::size_t i = 0; i < kBlockVoxels; i += hn::Lanes(kFloats)) {
    const auto depth_of_voxel = hn::Add(first_z, hn::Load(kFloats, frame.dz.data() + i));
    const auto given = hn::Load(kFloats, depths.depth + i), depth = hn::Abs(given);
    const auto raw = hn::Sub(depth, depth_of_voxel);
    const auto sigma = hn::Mul(rules.sigma, hn::Mul(depth_of_voxel, depth_of_voxel));
    const auto deepest = hn::Neg(hn::MulAdd(hn::Set(kFloats, kTailSigmas), sigma, rules.truncation));
    // Before the arm only what is free is measured.
    const auto least = hn::IfNegativeThenElse(given, rules.truncation, deepest);
    const auto observed = hn::And(hn::Gt(depth, hn::Zero(kFloats)), hn::Ge(raw, least));
    if (hn::AllFalse(kFloats, observed)) continue;

    const auto held_steps = hn::Load(kShorts, block.distance.data() + i);
    const auto weight_bytes = hn::Load(kBytes, block.weight.data() + i);
    const auto held = hn::Mul(hn::ConvertTo(kFloats, hn::PromoteTo(kInts, held_steps)), from_steps);
    const auto weight = hn::ConvertTo(kFloats, hn::PromoteTo(kInts, weight_bytes));
    const auto measured = hn::Max(hn::Min(raw, rules.truncation), hn::Neg(rules.truncation));
    const auto reset = surprised(rules, depth, raw, measured, held);
    const auto next = hn::IfThenElse(reset, one, hn::Min(hn::Add(weight, one), rules.max_weight));
    // The first measurement, and one that resets, count alone.
    const auto alone = hn::Or(reset, hn::Eq(weight, hn::Zero(kFloats)));
    const auto mean = hn::MulAdd(hn::Sub(measured, held), reciprocal(next), held);
    const auto fused = hn::IfThenElse(observed, hn::IfThenElse(alone, measured, mean), held);
    const auto steps = hn::NearestInt(hn::Mul(fused, to_steps));
    hn::Store(hn::DemoteTo(kShorts, steps), kShorts, block.distance.data() + i);
    hn::Store(hn::DemoteTo(kBytes, hn::ConvertTo(kInts, hn::IfThenElse(observed, next, weight))), kBytes,
              block.weight.data() + i);
    put_votes(rules, observed, fused, dead_band(rules, sigma, next), i, votes);
  }
}

/// One axis of a point on each ray, in blocks: whether it lies in the grid, and its block.
struct Along {
  Mask inside;
  hn::Vec<Ints> block;
};
HWY_INLINE Along along(const RayView& rays, std::size_t axis, Vector x, Vector y, Vector depth) {
  const auto direction =
      hn::MulAdd(hn::Set(kFloats, rays.along_x[axis]), x,
                 hn::MulAdd(hn::Set(kFloats, rays.along_y[axis]), y, hn::Set(kFloats, rays.along_z[axis])));
  const auto place = hn::MulAdd(direction, depth, hn::Set(kFloats, rays.eye[axis]));
  const auto inside = hn::And(hn::Ge(place, hn::Zero(kFloats)),
                              hn::Lt(place, hn::Set(kFloats, static_cast<float>(rays.size[axis]))));
  return {inside, hn::ConvertTo(kInts, hn::IfThenElseZero(inside, place))};
}

std::size_t FindMissing(const RayView& rays, const float* depth_vox, std::int32_t width, std::int32_t v,
                        std::int32_t* missing) {
  const auto lanes = static_cast<std::int32_t>(hn::Lanes(kFloats));
  const auto y = hn::Set(kFloats, (static_cast<float>(v) - rays.cy) * rays.inverse_fy);
  const auto to_blocks = hn::Set(kFloats, rays.voxels_to_blocks);
  const auto nx = hn::Set(kInts, rays.size[0]), ny = hn::Set(kInts, rays.size[1]);
  std::size_t found = 0;
  for (std::int32_t u = 0; u < width; u += lanes) {
    const auto some = hn::FirstN(kFloats, static_cast<std::size_t>(width - u));
    const auto depth = hn::MaskedLoad(some, kFloats, depth_vox + u);
    const auto valid = hn::Gt(depth, hn::Zero(kFloats));
    if (hn::AllFalse(kFloats, valid)) continue;
    const auto x = hn::Mul(hn::Sub(hn::Iota(kFloats, static_cast<float>(u)), hn::Set(kFloats, rays.cx)),
                           hn::Set(kFloats, rays.inverse_fx));
    for (const float offset : {-rays.truncation, 0.0F, rays.truncation}) {
      const auto at = hn::Mul(hn::Add(depth, hn::Set(kFloats, offset)), to_blocks);
      const Along a = along(rays, 0, x, y, at), b = along(rays, 1, x, y, at), c = along(rays, 2, x, y, at);
      const auto inside = hn::And(hn::And(valid, a.inside), hn::And(b.inside, c.inside));
      const auto place = hn::Add(hn::Mul(hn::Add(hn::Mul(c.block, ny), b.block), nx), a.block);
      const auto in_directory = hn::IfThenElseZero(hn::RebindMask(kInts, inside), place);
      const auto slot = hn::GatherIndex(kInts, rays.directory, in_directory);
      const auto none = hn::And(hn::RebindMask(kInts, inside), hn::Lt(slot, hn::Zero(kInts)));
      if (!hn::AllFalse(kInts, none)) found += hn::CompressStore(place, none, kInts, missing + found);
    }
  }
  return found;
}

}  // namespace phantom::fusion::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace phantom::fusion::detail {

HWY_EXPORT(FuseBlock);
HWY_EXPORT(FindMissing);

void fuse_block(const FrameView& frame, float u, float v, float z, FusedBlock& block, BlockVotes& votes) {
  HWY_DYNAMIC_DISPATCH(FuseBlock)(frame, u, v, z, block, votes);
}

std::size_t find_missing(const RayView& rays, const float* depth_vox, std::int32_t width, std::int32_t v,
                         std::int32_t* missing) {
  return HWY_DYNAMIC_DISPATCH(FindMissing)(rays, depth_vox, width, v, missing);
}

}  // namespace phantom::fusion::detail
#endif  // HWY_ONCE

// Compiled once for each instruction set by Highway's foreach_target; the best one is chosen at run time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "common/robot/sensing_kernel.cpp"
#include <hwy/foreach_target.h>  // must come before highway.h
#include <hwy/highway.h>

#include "common/robot/sensing_kernel.hpp"

HWY_BEFORE_NAMESPACE();
namespace phantom::robot::kernel {
namespace HWY_NAMESPACE {

#if HWY_TARGET == HWY_SCALAR

void LookUp(const Field& field, const ToVoxels& to, const Points& points, std::uint8_t* codes,
            std::uint32_t* voxels) {
  scalar::look_up(field, to, points, codes, voxels);
}
void AddMoments(const Points& points, const double* mu, Moments& moments) {
  scalar::add_moments(points, mu, moments);
}
void Sense(const Field& field, const ToVoxels& to, const Points& points, const float* palette, std::size_t,
           std::uint8_t* codes, Moments& moments) {
  scalar::sense(field, to, points, palette, codes, moments);
}
void AddGradients(const Field& field, const ToVoxels& to, const Points& points, const float* palette, std::size_t,
                  const std::uint8_t* codes, const double* mu, int reach_vox, GradientSums& sums) {
  scalar::add_gradients(field, to, points, palette, codes, mu, reach_vox, sums);
}
CodeFigures FiguresOf(const std::uint8_t* codes, std::size_t n) { return scalar::figures_of(codes, n); }
void CountCodes(const std::uint8_t* bytes, std::size_t n, std::size_t codes, std::uint32_t* counts) {
  scalar::count_codes(bytes, n, codes, counts);
}

#else

namespace hn = hwy::HWY_NAMESPACE;

// Integers and floats come in vectors of twice as many lanes as doubles: "low" and "high" are their halves.
using Doubles = hn::CappedTag<double, kGroup / 2>;
using Ints = hn::Repartition<std::int32_t, Doubles>;
using Words = hn::Repartition<std::uint32_t, Doubles>;
using Floats = hn::Repartition<float, Doubles>;
using HalfInts = hn::Half<Ints>;
using HalfFloats = hn::Half<Floats>;
using VD = hn::Vec<Doubles>;
using VI = hn::Vec<Ints>;
using VW = hn::Vec<Words>;

HWY_INLINE std::size_t lanes() { return hn::Lanes(Ints()); }

HWY_INLINE VD promote_low(hn::Vec<Floats> v) { return hn::PromoteTo(Doubles(), hn::LowerHalf(HalfFloats(), v)); }
HWY_INLINE VD promote_high(hn::Vec<Floats> v) { return hn::PromoteTo(Doubles(), hn::UpperHalf(HalfFloats(), v)); }

/// One row of the transform on half a vector of points.
HWY_INLINE VD coordinate(const double* r, double t, VD x, VD y, VD z) {
  const Doubles d;
  return hn::MulAdd(hn::Set(d, r[0]), x,
                    hn::MulAdd(hn::Set(d, r[1]), y, hn::MulAdd(hn::Set(d, r[2]), z, hn::Set(d, t))));
}

/// Voxel indices of a group of points.
struct Indices {
  VI x, y, z;
};

HWY_INLINE VI index(const double* r, double t, const Points& points, std::size_t i) {
  const Doubles d;
  const std::size_t half = hn::Lanes(d);
  // Adding 1.5·2^52 leaves the nearest integer in the low bits of a double; half a voxel less makes it floor(). The
  // border's shift keeps away from ties.
  const VD magic = hn::Set(d, 6755399441055744.0);
  const double down = t + (kBorderShift_vox - 0.5);
  const VD low = coordinate(r, down, hn::LoadU(d, points.x_m + i), hn::LoadU(d, points.y_m + i),
                            hn::LoadU(d, points.z_m + i));
  const VD high = coordinate(r, down, hn::LoadU(d, points.x_m + i + half), hn::LoadU(d, points.y_m + i + half),
                             hn::LoadU(d, points.z_m + i + half));
  const Ints di;
  return hn::ConcatEven(di, hn::BitCast(di, hn::Add(high, magic)), hn::BitCast(di, hn::Add(low, magic)));
}

HWY_INLINE Indices indices(const ToVoxels& to, const Points& points, std::size_t i) {
  return {index(to.r, to.t[0], points, i), index(to.r + 3, to.t[1], points, i), index(to.r + 6, to.t[2], points, i)};
}

/// What one coordinate adds to a voxel's address: to the brick's place in the directory, to the 32-bit word in the
/// brick (brick_offset in steps of four voxels along x), and whether it is in the grid.
struct AlongAxis {
  VI brick, word;
  hn::Mask<Words> inside;
};

template <int kAxis>
HWY_INLINE AlongAxis along_axis(const Field& field, VI v) {
  const Ints di;
  const Words dw;
  const auto inside =
      hn::Lt(hn::BitCast(dw, v), hn::Set(dw, static_cast<std::uint32_t>(field.size_vox[kAxis])));
  VI brick = hn::ShiftRight<5>(v), word;
  if (kAxis == 0) {
    word = hn::And(hn::ShiftLeft<2>(v), hn::Set(di, 28 << 2));
  } else if (kAxis == 1) {
    brick = hn::Mul(brick, hn::Set(di, field.size_bricks[0]));
    word = hn::OrAnd(hn::And(v, hn::Set(di, 3)), hn::ShiftLeft<5>(v), hn::Set(di, 28 << 5));
  } else {
    brick = hn::Mul(brick, hn::Set(di, field.size_bricks[0] * field.size_bricks[1]));
    word = hn::OrAnd(hn::And(hn::ShiftLeft<2>(v), hn::Set(di, 3 << 2)), hn::ShiftLeft<8>(v), hn::Set(di, 28 << 8));
  }
  return {brick, word, inside};
}

/// Codes at the places that three coordinates make; `byte_shift` picks the voxel in its word. Outside: 0.
HWY_INLINE VI codes_at(const Field& field, const AlongAxis& x, const AlongAxis& y, const AlongAxis& z,
                       VW byte_shift) {
  const Ints di;
  const Words dw;
  const auto inside = hn::And(hn::And(x.inside, y.inside), z.inside);
  const VI place = hn::Add(hn::Add(x.brick, y.brick), z.brick);
  const VI safe = hn::BitCast(di, hn::IfThenElseZero(inside, hn::BitCast(dw, place)));
  // Neighbours mostly share a brick: then one load stands for the gather.
  const std::int32_t one = hn::GetLane(safe);
  const VI slot = hn::AllTrue(di, hn::Eq(safe, hn::Set(di, one)))
                      ? hn::Set(di, static_cast<std::int32_t>(field.directory[one]))
                      : hn::GatherIndex(di, reinterpret_cast<const std::int32_t*>(field.directory), safe);
  const VI word = hn::Or(hn::ShiftLeft<13>(slot), hn::Or(hn::Or(x.word, y.word), z.word));
  const VW four = hn::GatherIndex(dw, reinterpret_cast<const std::uint32_t*>(field.codes), word);
  const VW code = hn::And(hn::Shr(four, byte_shift), hn::Set(dw, 0xFF));
  return hn::BitCast(di, hn::IfThenElseZero(inside, code));
}

HWY_INLINE VW byte_shift_of(VI x) {
  const VI in_word = hn::ShiftLeft<3>(hn::And(x, hn::Set(Ints(), 3)));
  return hn::BitCast(Words(), in_word);
}

HWY_INLINE VI codes_of(const Field& field, const Indices& at) {
  return codes_at(field, along_axis<0>(field, at.x), along_axis<1>(field, at.y), along_axis<2>(field, at.z),
                  byte_shift_of(at.x));
}

HWY_INLINE void store_codes(VI codes, std::uint8_t* out) {
  const hn::Rebind<std::uint8_t, Ints> bytes;
  hn::StoreU(hn::TruncateTo(bytes, hn::BitCast(Words(), codes)), bytes, out);
}

/// Ten running sums, a vector of partial sums each.
struct Sums {
  VD s[10];

  HWY_INLINE Sums() {
    for (VD& v : s) v = hn::Zero(Doubles());
  }
  HWY_INLINE void add(const Points& points, std::size_t i, VD mu) {
    const Doubles d;
    const VD x = hn::LoadU(d, points.x_m + i), y = hn::LoadU(d, points.y_m + i), z = hn::LoadU(d, points.z_m + i);
    const VD m = hn::Mul(mu, hn::LoadU(d, points.weight + i));
    const VD mx = hn::Mul(m, x), my = hn::Mul(m, y), mz = hn::Mul(m, z);
    s[0] = hn::Add(s[0], m);
    s[1] = hn::Add(s[1], mx);
    s[2] = hn::Add(s[2], my);
    s[3] = hn::Add(s[3], mz);
    s[4] = hn::MulAdd(mx, x, s[4]);
    s[5] = hn::MulAdd(mx, y, s[5]);
    s[6] = hn::MulAdd(mx, z, s[6]);
    s[7] = hn::MulAdd(my, y, s[7]);
    s[8] = hn::MulAdd(my, z, s[8]);
    s[9] = hn::MulAdd(mz, z, s[9]);
  }
  HWY_INLINE void take(double* out) const {
    for (std::size_t k = 0; k < 10; ++k) out[k] += hn::GetLane(hn::SumOfLanes(Doubles(), s[k]));
  }
};

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
  Sums sums;
  for (std::size_t i = 0; i < points.count; i += half) sums.add(points, i, hn::LoadU(d, mu + i));
  sums.take(moments.sum);
}

/// μ of codes below kTables vectors' worth, from registers: a permutation each instead of a gather.
template <int kTables>
class SmallPalette {
 public:
  HWY_INLINE explicit SmallPalette(const float* palette) {
    const Floats df;
    for (int k = 0; k < kTables; ++k) tables_[k] = hn::LoadU(df, palette + static_cast<std::size_t>(k) * hn::Lanes(df));
  }
  HWY_INLINE hn::Vec<Floats> operator()(VI code) const {
    const Ints di;
    const Floats df;
    const auto n = static_cast<std::int32_t>(hn::Lanes(di));
    const auto within = hn::IndicesFromVec(df, hn::And(code, hn::Set(di, n - 1)));
    auto mu = hn::TableLookupLanes(tables_[0], within);
    for (int k = 1; k < kTables; ++k) {
      const auto beyond = hn::RebindMask(df, hn::Gt(code, hn::Set(di, k * n - 1)));
      mu = hn::IfThenElse(beyond, hn::TableLookupLanes(tables_[k], within), mu);
    }
    return mu;
  }

 private:
  hn::Vec<Floats> tables_[kTables];
};

class AnyPalette {
 public:
  HWY_INLINE explicit AnyPalette(const float* palette) : palette_(palette) {}
  HWY_INLINE hn::Vec<Floats> operator()(VI code) const { return hn::GatherIndex(Floats(), palette_, code); }

 private:
  const float* palette_;
};

/// Calls work(palette) with the quickest form of a palette of so many codes.
template <class Work>
HWY_INLINE void with_palette(const float* palette, std::size_t codes, Work&& work) {
  const std::size_t n = hn::Lanes(Floats());
  if (codes <= n) {
    work(SmallPalette<1>(palette));
  } else if (codes <= 2 * n) {
    work(SmallPalette<2>(palette));
  } else if (codes <= 4 * n) {
    work(SmallPalette<4>(palette));
  } else {
    work(AnyPalette(palette));
  }
}

void Sense(const Field& field, const ToVoxels& to, const Points& points, const float* palette, std::size_t palette_size,
           std::uint8_t* codes, Moments& moments) {
  // Block by block in two passes: each keeps what it needs in registers, and the block stays in the first cache.
  const Ints di;
  const hn::Rebind<std::uint8_t, Ints> bytes;
  const std::size_t half = hn::Lanes(Doubles());
  with_palette(palette, palette_size, [&](const auto& mu_of) HWY_ATTR {
    Sums sums;
    for (std::size_t first = 0; first < points.count; first += kBlock) {
      const std::size_t end = first + kBlock < points.count ? first + kBlock : points.count;
      for (std::size_t i = first; i < end; i += lanes()) store_codes(codes_of(field, indices(to, points, i)), codes + i);
      for (std::size_t i = first; i < end; i += lanes()) {
        const auto mu = mu_of(hn::PromoteTo(di, hn::LoadU(bytes, codes + i)));
        sums.add(points, i, promote_low(mu));
        sums.add(points, i + half, promote_high(mu));
      }
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
  /// `step`: μ one reach up minus μ one reach down, by axis; `met`: the palette's μ, 0 where nothing counts.
  HWY_INLINE void add(const ToVoxels& to, const Points& points, std::size_t i, const VD step[3], VD met, VD mu) {
    const Doubles d;
    const VD x = hn::LoadU(d, points.x_m + i), y = hn::LoadU(d, points.y_m + i), z = hn::LoadU(d, points.z_m + i);
    const VD rx = coordinate(to.r, 0.0, x, y, z), ry = coordinate(to.r + 3, 0.0, x, y, z),
             rz = coordinate(to.r + 6, 0.0, x, y, z);
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
                  std::size_t palette_size, const std::uint8_t* codes, const double* given_mu, int reach_vox, GradientSums& out) {
  const Ints di;
  const Doubles d;
  const hn::Rebind<std::uint8_t, Ints> bytes;
  const std::size_t half = hn::Lanes(d);
  const VI reach = hn::Set(di, reach_vox);
  with_palette(palette, palette_size, [&](const auto& mu_at) HWY_ATTR {
    SlopeSums sums;
    for (std::size_t i = 0; i < points.count; i += lanes()) {
      const VI code = hn::PromoteTo(di, hn::LoadU(bytes, codes + i));
      if (hn::AllTrue(di, hn::Eq(code, hn::Zero(di)))) continue;
      const Indices at = indices(to, points, i);
      const AlongAxis x = along_axis<0>(field, at.x), y = along_axis<1>(field, at.y), z = along_axis<2>(field, at.z);
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
        low[axis] = hn::Sub(promote_low(up[axis]), promote_low(down[axis]));
        high[axis] = hn::Sub(promote_high(up[axis]), promote_high(down[axis]));
      }
      const auto met = mu_at(code);
      const VD met_low = promote_low(met), met_high = promote_high(met);
      sums.add(to, points, i, low, met_low, given_mu != nullptr ? hn::LoadU(d, given_mu + i) : met_low);
      sums.add(to, points, i + half, high, met_high,
               given_mu != nullptr ? hn::LoadU(d, given_mu + i + half) : met_high);
    }
    const double per_vox = 1.0 / (2.0 * reach_vox);
    for (std::size_t k = 0; k < 7; ++k)
      out.sum[k] += (k < 6 ? per_vox : per_vox * per_vox) * hn::GetLane(hn::SumOfLanes(d, sums.s[k]));
  });
}

CodeFigures FiguresOf(const std::uint8_t* codes, std::size_t n) {
  const hn::ScalableTag<std::uint8_t> d;
  const std::size_t step = hn::Lanes(d);
  CodeFigures figures;
  auto greatest = hn::Zero(d);
  std::size_t i = 0;
  for (; i + step <= n; i += step) {
    const auto v = hn::LoadU(d, codes + i);
    greatest = hn::Max(greatest, v);
    figures.active += hn::CountTrue(d, hn::Ne(v, hn::Zero(d)));
  }
  HWY_ALIGN std::uint8_t lane[HWY_MAX_BYTES];
  hn::Store(greatest, d, lane);
  for (std::size_t k = 0; k < step; ++k) figures.greatest = lane[k] > figures.greatest ? lane[k] : figures.greatest;
  for (; i < n; ++i) {
    figures.greatest = codes[i] > figures.greatest ? codes[i] : figures.greatest;
    figures.active += codes[i] != 0 ? 1U : 0U;
  }
  return figures;
}

void CountCodes(const std::uint8_t* bytes, std::size_t n, std::size_t codes, std::uint32_t* counts) {
  const hn::CappedTag<std::uint8_t, kCountStep> d;
  const std::size_t step = hn::Lanes(d);
  for (std::size_t c = 1; c < codes; ++c) {
    const auto code = hn::Set(d, static_cast<std::uint8_t>(c));
    std::size_t count = 0;
    for (std::size_t i = 0; i < n; i += step) count += hn::CountTrue(d, hn::Eq(hn::LoadU(d, bytes + i), code));
    counts[c] = static_cast<std::uint32_t>(count);
  }
}

#endif  // HWY_TARGET == HWY_SCALAR

const char* Target() { return hwy::TargetName(HWY_TARGET); }

}  // namespace HWY_NAMESPACE
}  // namespace phantom::robot::kernel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace phantom::robot::kernel {

HWY_EXPORT(LookUp);
HWY_EXPORT(AddMoments);
HWY_EXPORT(Sense);
HWY_EXPORT(AddGradients);
HWY_EXPORT(FiguresOf);
HWY_EXPORT(CountCodes);
HWY_EXPORT(Target);

Field field_of(const voxel::Workspace& workspace) noexcept {
  const auto& size = workspace.grid().size_vox;
  const auto& bricks = workspace.size_bricks();
  return {workspace.directory(), workspace.codes(), {size[0], size[1], size[2]}, {bricks[0], bricks[1], bricks[2]}};
}

void look_up(const Field& field, const ToVoxels& to_voxels, const Points& points, std::uint8_t* codes,
             std::uint32_t* voxels) noexcept {
  HWY_DYNAMIC_DISPATCH(LookUp)(field, to_voxels, points, codes, voxels);
}

void add_moments(const Points& points, const double* mu, Moments& moments) noexcept {
  HWY_DYNAMIC_DISPATCH(AddMoments)(points, mu, moments);
}

void sense(const Field& field, const ToVoxels& to_voxels, const Points& points, const float* palette,
           std::size_t palette_size, std::uint8_t* codes, Moments& moments) noexcept {
  HWY_DYNAMIC_DISPATCH(Sense)(field, to_voxels, points, palette, palette_size, codes, moments);
}

void add_gradients(const Field& field, const ToVoxels& to_voxels, const Points& points, const float* palette,
                   std::size_t palette_size, const std::uint8_t* codes, const double* mu, int reach_vox, GradientSums& sums) noexcept {
  HWY_DYNAMIC_DISPATCH(AddGradients)(field, to_voxels, points, palette, palette_size, codes, mu, reach_vox, sums);
}

CodeFigures figures_of(const std::uint8_t* codes, std::size_t n) noexcept {
  return HWY_DYNAMIC_DISPATCH(FiguresOf)(codes, n);
}

void count_codes(const std::uint8_t* bytes, std::size_t n, std::size_t codes, std::uint32_t* counts) noexcept {
  HWY_DYNAMIC_DISPATCH(CountCodes)(bytes, n, codes, counts);
}

const char* target_name() noexcept { return HWY_DYNAMIC_DISPATCH(Target)(); }

}  // namespace phantom::robot::kernel
#endif  // HWY_ONCE

// Vector operations of the sensing loops: from points to voxels, to codes, to viscosities, and the ten sums.
// Private to sensing_kernel.cpp, which includes it once for each instruction set: it has no guard.
#include <hwy/highway.h>

#include "common/robot/sensing/sensing_kernel.hpp"

HWY_BEFORE_NAMESPACE();
namespace phantom::robot::kernel::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// Vectors of integers and floats have twice as many lanes as vectors of doubles; "low" and "high" are their
// halves.
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

HWY_INLINE VD promote_low(hn::Vec<Floats> v) {
  return hn::PromoteTo(Doubles(), hn::LowerHalf(HalfFloats(), v));
}
HWY_INLINE VD promote_high(hn::Vec<Floats> v) {
  return hn::PromoteTo(Doubles(), hn::UpperHalf(HalfFloats(), v));
}

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
  // Adding 1.5·2^52 leaves the nearest integer in the low bits of a double. Subtracting half a voxel turns
  // rounding into floor(). kBorderShift_vox avoids ties.
  const VD magic = hn::Set(d, 6755399441055744.0);
  const double down = t + (kBorderShift_vox - 0.5);
  const VD low = coordinate(r, down, hn::LoadU(d, points.x_m + i), hn::LoadU(d, points.y_m + i),
                            hn::LoadU(d, points.z_m + i));
  const VD high = coordinate(r, down, hn::LoadU(d, points.x_m + i + half),
                             hn::LoadU(d, points.y_m + i + half), hn::LoadU(d, points.z_m + i + half));
  const Ints di;
  return hn::ConcatEven(di, hn::BitCast(di, hn::Add(high, magic)), hn::BitCast(di, hn::Add(low, magic)));
}

HWY_INLINE Indices indices(const ToVoxels& to, const Points& points, std::size_t i) {
  return {index(to.r, to.t[0], points, i), index(to.r + 3, to.t[1], points, i),
          index(to.r + 6, to.t[2], points, i)};
}

/// Contribution of one coordinate to a voxel's address: to the brick's index in the directory and to the
/// 32-bit word in the brick (brick_offset in steps of four voxels along x). Also whether the coordinate is in
/// the grid.
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
    word = hn::OrAnd(hn::And(hn::ShiftLeft<2>(v), hn::Set(di, 3 << 2)), hn::ShiftLeft<8>(v),
                     hn::Set(di, 28 << 8));
  }
  return {brick, word, inside};
}

/// Returns the codes at the positions given by three coordinates; `byte_shift` selects the voxel in its word.
/// Outside the grid: 0.
HWY_INLINE VI codes_at(const Field& field, const AlongAxis& x, const AlongAxis& y, const AlongAxis& z,
                       VW byte_shift) {
  const Ints di;
  const Words dw;
  const auto inside = hn::And(hn::And(x.inside, y.inside), z.inside);
  const VI place = hn::Add(hn::Add(x.brick, y.brick), z.brick);
  const VI safe = hn::BitCast(di, hn::IfThenElseZero(inside, hn::BitCast(dw, place)));
  // Neighbours mostly share a brick. Then one load replaces the gather.
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

/// Looks up μ for codes below kTables vectors' length, from registers: a permutation for each vector instead
/// of a gather.
template <int kTables>
class SmallPalette {
 public:
  HWY_INLINE explicit SmallPalette(const float* palette) {
    const Floats df;
    for (int k = 0; k < kTables; ++k)
      tables_[k] = hn::LoadU(df, palette + static_cast<std::size_t>(k) * hn::Lanes(df));
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

/// Calls work(palette) with the fastest kind of palette for this number of codes.
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

/// Running sums of m, m·p and m·ppᵀ over points p, each a vector of partial sums.
struct SpatialInertiaSums {
  VD s[10];

  HWY_INLINE SpatialInertiaSums() {
    for (VD& v : s) v = hn::Zero(Doubles());
  }
  HWY_INLINE void add(VD m, VD x, VD y, VD z) {
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

/// Adds half a vector of points, from index `i` on, with viscosities `mu`.
HWY_INLINE void add_points(const Points& points, std::size_t i, VD mu, SpatialInertiaSums& sums) {
  const Doubles d;
  const VD x = hn::LoadU(d, points.x_m + i), y = hn::LoadU(d, points.y_m + i),
           z = hn::LoadU(d, points.z_m + i);
  sums.add(hn::Mul(mu, hn::LoadU(d, points.weight + i)), x, y, z);
}

}  // namespace phantom::robot::kernel::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

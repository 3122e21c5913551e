// Compiled once for each instruction set by Highway's foreach_target; the best one is chosen at run time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "common/robot/sensing_kernel.cpp"
#include <hwy/foreach_target.h>  // must come before highway.h
#include <hwy/highway.h>

#include <cmath>

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
void Sense(const Field& field, const ToVoxels& to, const Points& points, const Offsets&, const float* palette, std::size_t,
           std::uint8_t* codes, Moments& moments) {
  scalar::sense(field, to, points, palette, codes, moments);
}
void AddGradients(const Field& field, const ToVoxels& to, const Points& points, const float* palette, std::size_t,
                  const std::uint8_t* codes, const double* mu, int reach_vox, GradientSums& sums) {
  scalar::add_gradients(field, to, points, palette, codes, mu, reach_vox, sums);
}
CodeFigures FiguresOf(const std::uint8_t* codes, std::size_t n) { return scalar::figures_of(codes, n); }
void CountCodes(const std::uint8_t* const* tiles, const std::uint64_t* masks, std::size_t n, std::size_t codes,
                std::uint32_t* counts) {
  scalar::count_codes(tiles, masks, n, codes, counts);
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

/// From a link's steps to voxels in floats; how a block of points that lies in at most eight bricks is looked up. A float
/// of 128 to 256 holds a coordinate from the lowest brick's corner on in its lowest bits: 7 of whole voxels (< 64) above
/// 16 of fractions.
class Near {
 public:
  HWY_INLINE explicit Near(const ToVoxels& to) : per_m_(std::sqrt(to.r[0] * to.r[0] + to.r[1] * to.r[1] + to.r[2] * to.r[2])) {}
  /// False if the block does not lie within so few bricks of the grid: then look_up() is not for it.
  HWY_INLINE bool place(const Field& field, const ToVoxels& to, const Block& block) {
    std::int32_t low[3], step[3];
    const double reach = per_m_ * block.radius_m + 0.01;
    for (int k = 0; k < 3; ++k) {
      const double* r = to.r + 3 * k;
      const double at = r[0] * block.centre_m[0] + r[1] * block.centre_m[1] + r[2] * block.centre_m[2] + (to.t[k] + kBorderShift_vox);
      if (!(at - reach >= 0.0 && at + reach < field.size_vox[k])) return false;
      low[k] = static_cast<std::int32_t>(at - reach) >> 5;
      step[k] = (static_cast<std::int32_t>(at + reach) >> 5) - low[k];
      if (step[k] > 1) return false;
      for (int j = 0; j < 3; ++j) r_[3 * k + j] = static_cast<float>(r[j] * block.step_m);
      start_[k] = static_cast<float>(at - 32 * low[k] + (128.0 + kDoubt / 131072.0));
    }
    const std::int32_t along_y = field.size_bricks[0], along_z = along_y * field.size_bricks[1];
    const std::uint32_t* corner = field.directory + low[0] + low[1] * along_y + low[2] * along_z;
    const std::int32_t up_x = step[0], up_y = step[1] * along_y, up_z = step[2] * along_z;
    const auto word_of = [corner](std::int32_t at) { return static_cast<std::int32_t>(corner[at] << 13); };
    first_word_[0] = word_of(0), first_word_[1] = word_of(up_x);
    first_word_[2] = word_of(up_y), first_word_[3] = word_of(up_x + up_y);
    first_word_[4] = word_of(up_z), first_word_[5] = word_of(up_x + up_z);
    first_word_[6] = word_of(up_y + up_z), first_word_[7] = word_of(up_x + up_y + up_z);
    return true;
  }
  HWY_INLINE void look_up(const Field& field, const ToVoxels& to, const Points& points, const Offsets& offsets,
                          std::size_t first, std::size_t end, std::uint8_t* out) const {
    const Floats df;
    const Ints di;
    const Words dw;
    const auto r0 = hn::Set(df, r_[0]), r1 = hn::Set(df, r_[1]), r2 = hn::Set(df, r_[2]), r3 = hn::Set(df, r_[3]),
               r4 = hn::Set(df, r_[4]), r5 = hn::Set(df, r_[5]), r6 = hn::Set(df, r_[6]), r7 = hn::Set(df, r_[7]),
               r8 = hn::Set(df, r_[8]), start_x = hn::Set(df, start_[0]), start_y = hn::Set(df, start_[1]),
               start_z = hn::Set(df, start_[2]);
    // Bytes may alias anything: what the loop needs must not be read again after each store.
    const std::int32_t *const steps_x = offsets.x, *const steps_y = offsets.y, *const steps_z = offsets.z;
    const auto* const codes = reinterpret_cast<const std::uint32_t*>(field.codes);
    const Corners first_word(first_word_);
    const VI x_tile = constant(28 << 2), y_in_tile = constant(3), y_tile = constant(28 << 5), z_in_tile = constant(3 << 2),
             z_tile = constant(28 << 8), one = constant(1), two = constant(2), four = constant(4), x_in_word = constant(3 << 3),
             byte = constant(0xFF), decided = constant(0xFFFF & ~(kDoubt - 1));
    for (std::size_t i = first; i < end; i += lanes()) {
      const auto dx = hn::ConvertTo(df, hn::LoadU(di, steps_x + i)), dy = hn::ConvertTo(df, hn::LoadU(di, steps_y + i)),
                 dz = hn::ConvertTo(df, hn::LoadU(di, steps_z + i));
      const VI x = hn::BitCast(di, hn::MulAdd(r0, dx, hn::MulAdd(r1, dy, hn::MulAdd(r2, dz, start_x))));
      const VI y = hn::BitCast(di, hn::MulAdd(r3, dx, hn::MulAdd(r4, dy, hn::MulAdd(r5, dz, start_y))));
      const VI z = hn::BitCast(di, hn::MulAdd(r6, dx, hn::MulAdd(r7, dy, hn::MulAdd(r8, dz, start_z))));
      if (HWY_UNLIKELY(in_doubt(x, y, z, decided))) {
        store_codes(codes_of(field, indices(to, points, i)), out + i);
        continue;
      }
      VI word = hn::And(hn::ShiftRight<14>(x), x_tile);
      word = hn::OrAnd(word, hn::ShiftRight<16>(y), y_in_tile);
      word = hn::OrAnd(word, hn::ShiftRight<11>(y), y_tile);
      word = hn::OrAnd(word, hn::ShiftRight<14>(z), z_in_tile);
      word = hn::OrAnd(word, hn::ShiftRight<8>(z), z_tile);
      VI corner = hn::And(hn::ShiftRight<21>(x), one);
      corner = hn::OrAnd(corner, hn::ShiftRight<20>(y), two);
      corner = hn::OrAnd(corner, hn::ShiftRight<19>(z), four);
      const VW word_there = hn::GatherIndex(dw, codes, hn::Or(word, first_word[corner]));
      const VI bits = hn::And(hn::ShiftRight<13>(x), x_in_word);
      const VW code = hn::And(hn::Shr(word_there, hn::BitCast(dw, bits)), hn::BitCast(dw, byte));
      store_codes(hn::BitCast(di, code), out + i);
    }
  }

 private:
  /// Steps of 2^-16 voxels that a point must be from a border for floats to decide: the start and three products of
  /// offsets below 32 voxels are off by less than three.
  static constexpr std::int32_t kDoubt = 8;

  static HWY_INLINE bool in_doubt(VI x, VI y, VI z, VI decided) {
    const hn::Repartition<std::uint16_t, Ints> fractions;
    const auto least = hn::Min(hn::BitCast(fractions, x), hn::Min(hn::BitCast(fractions, y), hn::BitCast(fractions, z)));
    const Ints di;
    return !hn::AllFalse(di, hn::Eq(hn::And(hn::BitCast(di, least), decided), hn::Zero(di)));
  }
  /// A constant that the compiler does not know to be one: else it makes it anew in the loop, which costs as much as using it.
  static HWY_INLINE VI constant(std::int32_t value) {
#if HWY_COMPILER_GCC_ACTUAL
    asm("" : "+r"(value));
#endif
    return hn::Set(Ints(), value);
  }
  /// First words of the eight bricks, by corner.
  struct Corners {
#if HWY_TARGET <= HWY_AVX2
    HWY_INLINE explicit Corners(const std::int32_t* words) : table(hn::LoadU(Ints(), words)) {}
    HWY_INLINE VI operator[](VI corner) const { return hn::TableLookupLanes(table, hn::IndicesFromVec(Ints(), corner)); }
    VI table;
#else
    HWY_INLINE explicit Corners(const std::int32_t* words) : table(words) {}
    HWY_INLINE VI operator[](VI corner) const { return hn::GatherIndex(Ints(), table, corner); }
    const std::int32_t* table;
#endif
  };

  double per_m_;
  float r_[9], start_[3];
  std::int32_t first_word_[kGroup] = {};
};

/// Sums of a block about its centre, in steps.
struct BlockSums {
  VD s[10];

  HWY_INLINE BlockSums() {
    for (VD& v : s) v = hn::Zero(Doubles());
  }
  HWY_INLINE void add(const Offsets& offsets, std::size_t i, VD m) {
    const Doubles d;
    const HalfInts half;
    const VD x = hn::PromoteTo(d, hn::LoadU(half, offsets.x + i)), y = hn::PromoteTo(d, hn::LoadU(half, offsets.y + i)),
             z = hn::PromoteTo(d, hn::LoadU(half, offsets.z + i));
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
  /// Adds them to sums about the link's origin: with p = c + d, Σm·pp = Σm·dd + cΣm·d + (Σm·p)c.
  HWY_INLINE void take(const Block& block, VD* out) const {
    const Doubles d;
    const double weight = block.weight < 0.0 ? 1.0 : block.weight;
    const VD step = hn::Set(d, weight * block.step_m), square = hn::Set(d, weight * block.step_m * block.step_m);
    const VD m = hn::Mul(hn::Set(d, weight), s[0]);
    VD c[3], about_centre[3], moment[3];
    for (int k = 0; k < 3; ++k) {
      c[k] = hn::Set(d, block.centre_m[k]);
      about_centre[k] = hn::Mul(step, s[k + 1]);
      moment[k] = hn::MulAdd(c[k], m, about_centre[k]);
      out[k + 1] = hn::Add(out[k + 1], moment[k]);
    }
    out[0] = hn::Add(out[0], m);
    for (int a = 0, at = 4; a < 3; ++a) {
      for (int b = a; b < 3; ++b, ++at)
        out[at] = hn::MulAdd(square, s[at], hn::MulAdd(c[a], about_centre[b], hn::MulAdd(moment[a], c[b], out[at])));
    }
  }
};

void Sense(const Field& field, const ToVoxels& to, const Points& points, const Offsets& offsets, const float* palette,
           std::size_t palette_size, std::uint8_t* codes, Moments& moments) {
  // Block by block in two passes: each keeps what it needs in registers, and the block stays in the first cache.
  const Ints di;
  const Doubles d;
  const hn::Rebind<std::uint8_t, Ints> bytes;
  const std::size_t half = hn::Lanes(d);
  Near near(to);
  with_palette(palette, palette_size, [&](const auto& mu_of) HWY_ATTR {
    Sums sums;
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
        for (std::size_t i = first; i < end; i += lanes()) store_codes(codes_of(field, indices(to, points, i)), codes + i);
        add_all(first, end, [&](std::size_t i, VD mu) HWY_ATTR { sums.add(points, i, mu); });
        continue;
      }
      near.look_up(field, to, points, offsets, first, end, codes);
      BlockSums part;
      if (block->weight < 0.0) {
        add_all(first, end, [&](std::size_t i, VD mu) HWY_ATTR { part.add(offsets, i, hn::Mul(mu, hn::LoadU(d, points.weight + i))); });
      } else {
        add_all(first, end, [&](std::size_t i, VD mu) HWY_ATTR { part.add(offsets, i, mu); });
      }
      part.take(*block, sums.s);
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

void CountCodes(const std::uint8_t* const* tiles, const std::uint64_t* masks, std::size_t n, std::size_t codes,
                std::uint32_t* counts) {
  const hn::CappedTag<std::uint8_t, 64> d;
  const std::size_t step = hn::Lanes(d);
  for (std::size_t c = 1; c < codes; ++c) counts[c] = 0;
  for (std::size_t t = 0; t < n; ++t) {
    for (std::size_t i = 0; i < 64; i += step) {
      const auto bits = hn::LoadMaskBits(d, reinterpret_cast<const std::uint8_t*>(masks + t) + i / 8);
      const auto voxels = hn::IfThenElseZero(bits, hn::LoadU(d, tiles[t] + i));
      for (std::size_t c = 1; c < codes; ++c) {
        counts[c] += static_cast<std::uint32_t>(hn::CountTrue(d, hn::Eq(voxels, hn::Set(d, static_cast<std::uint8_t>(c)))));
      }
    }
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

void sense(const Field& field, const ToVoxels& to_voxels, const Points& points, const Offsets& offsets,
           const float* palette, std::size_t palette_size, std::uint8_t* codes, Moments& moments) noexcept {
  HWY_DYNAMIC_DISPATCH(Sense)(field, to_voxels, points, offsets, palette, palette_size, codes, moments);
}

void add_gradients(const Field& field, const ToVoxels& to_voxels, const Points& points, const float* palette,
                   std::size_t palette_size, const std::uint8_t* codes, const double* mu, int reach_vox, GradientSums& sums) noexcept {
  HWY_DYNAMIC_DISPATCH(AddGradients)(field, to_voxels, points, palette, palette_size, codes, mu, reach_vox, sums);
}

CodeFigures figures_of(const std::uint8_t* codes, std::size_t n) noexcept {
  return HWY_DYNAMIC_DISPATCH(FiguresOf)(codes, n);
}

void count_codes(const std::uint8_t* const* tiles, const std::uint64_t* masks, std::size_t n, std::size_t codes,
                 std::uint32_t* counts) noexcept {
  HWY_DYNAMIC_DISPATCH(CountCodes)(tiles, masks, n, codes, counts);
}

const char* target_name() noexcept { return HWY_DYNAMIC_DISPATCH(Target)(); }

}  // namespace phantom::robot::kernel
#endif  // HWY_ONCE

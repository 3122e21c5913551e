// The fast path for a block of neighbouring points: positions in floats, sums about the block's centre.
// Private to sensing_kernel.cpp, which includes it once for each instruction set: it has no guard.
#include <hwy/highway.h>

#include <cmath>

#include "common/robot/sensing/sensing_kernel.hpp"

HWY_BEFORE_NAMESPACE();
namespace phantom::robot::kernel::HWY_NAMESPACE {

/// Looks up a block of points that lies in at most eight bricks, with coordinates from link steps to voxels
/// in floats. A float of 128 to 256 holds a coordinate relative to the lowest brick's corner in its lowest
/// bits: 7 bits of whole voxels (< 64) above 16 bits of fraction.
class Near {
 public:
  HWY_INLINE explicit Near(const ToVoxels& to) {
    const double per_m = std::sqrt(to.r[0] * to.r[0] + to.r[1] * to.r[1] + to.r[2] * to.r[2]) * to.stretch[0];
    for (int k = 0; k < 3; ++k) per_m_[k] = per_m / to.stretch[k];
  }
  /// Prepares for a block. Returns false if the block does not lie within so few bricks of the grid; then
  /// look_up() must not be called for it.
  HWY_INLINE bool place(const Field& field, const ToVoxels& to, const Block& block) {
    std::int32_t low[3], step[3];
    for (int k = 0; k < 3; ++k) {
      const double reach = per_m_[k] * block.radius_m + 0.01;
      const double* r = to.r + 3 * k;
      const double at = r[0] * block.centre_m[0] + r[1] * block.centre_m[1] + r[2] * block.centre_m[2] +
                        (to.t[k] + kBorderShift_vox);
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
  HWY_INLINE void look_up(const Field& field, const ToVoxels& to, const Points& points,
                          const Offsets& offsets, std::size_t first, std::size_t end,
                          std::uint8_t* out) const {
    const Floats df;
    const Ints di;
    const Words dw;
    const auto r0 = hn::Set(df, r_[0]), r1 = hn::Set(df, r_[1]), r2 = hn::Set(df, r_[2]),
               r3 = hn::Set(df, r_[3]), r4 = hn::Set(df, r_[4]), r5 = hn::Set(df, r_[5]),
               r6 = hn::Set(df, r_[6]), r7 = hn::Set(df, r_[7]), r8 = hn::Set(df, r_[8]),
               start_x = hn::Set(df, start_[0]), start_y = hn::Set(df, start_[1]),
               start_z = hn::Set(df, start_[2]);
    // A byte pointer may alias anything. Local copies keep the compiler from reading these again after each
    // store.
    const std::int32_t *const steps_x = offsets.x, *const steps_y = offsets.y, *const steps_z = offsets.z;
    const auto* const codes = reinterpret_cast<const std::uint32_t*>(field.codes);
    const Corners first_word(first_word_);
    const VI x_tile = constant(28 << 2), y_in_tile = constant(3), y_tile = constant(28 << 5),
             z_in_tile = constant(3 << 2), z_tile = constant(28 << 8), one = constant(1), two = constant(2),
             four = constant(4), x_in_word = constant(3 << 3), byte = constant(0xFF),
             decided = constant(0xFFFF & ~(kDoubt - 1));
    for (std::size_t i = first; i < end; i += lanes()) {
      const auto dx = hn::ConvertTo(df, hn::LoadU(di, steps_x + i)),
                 dy = hn::ConvertTo(df, hn::LoadU(di, steps_y + i)),
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
  /// Distance from a border, in steps of 2^-16 voxels, that a point needs for floats to decide. The start and
  /// three products of offsets below 32 voxels err by less than three steps.
  static constexpr std::int32_t kDoubt = 8;

  static HWY_INLINE bool in_doubt(VI x, VI y, VI z, VI decided) {
    const hn::Repartition<std::uint16_t, Ints> fractions;
    const auto least =
        hn::Min(hn::BitCast(fractions, x), hn::Min(hn::BitCast(fractions, y), hn::BitCast(fractions, z)));
    const Ints di;
    return !hn::AllFalse(di, hn::Eq(hn::And(hn::BitCast(di, least), decided), hn::Zero(di)));
  }
  /// Returns a constant that the compiler cannot recognise as one. Otherwise it would rebuild the constant in
  /// the loop, which costs as much as using it.
  static HWY_INLINE VI constant(std::int32_t value) {
#if HWY_COMPILER_GCC_ACTUAL
    asm("" : "+r"(value));
#endif
    return hn::Set(Ints(), value);
  }
  /// First words of the eight bricks, indexed by corner.
  struct Corners {
#if HWY_TARGET <= HWY_AVX2
    HWY_INLINE explicit Corners(const std::int32_t* words) : table(hn::LoadU(Ints(), words)) {}
    HWY_INLINE VI operator[](VI corner) const {
      return hn::TableLookupLanes(table, hn::IndicesFromVec(Ints(), corner));
    }
    VI table;
#else
    HWY_INLINE explicit Corners(const std::int32_t* words) : table(words) {}
    HWY_INLINE VI operator[](VI corner) const { return hn::GatherIndex(Ints(), table, corner); }
    const std::int32_t* table;
#endif
  };

  double per_m_[3];
  float r_[9], start_[3];
  std::int32_t first_word_[kGroup] = {};
};

/// Adds half a vector of points, from index `i` on, as steps from their block's centre, with μ (or μ·weight)
/// `m`.
HWY_INLINE void add_steps(const Offsets& offsets, std::size_t i, VD m, SpatialInertiaSums& sums) {
  const Doubles d;
  const HalfInts half;
  const VD x = hn::PromoteTo(d, hn::LoadU(half, offsets.x + i)),
           y = hn::PromoteTo(d, hn::LoadU(half, offsets.y + i)),
           z = hn::PromoteTo(d, hn::LoadU(half, offsets.z + i));
  sums.add(m, x, y, z);
}

/// Adds a block's sums about its centre, in steps, to the sums about the link's origin. With p = c + d: Σm·pp
/// = Σm·dd + cΣm·d + (Σm·p)c.
HWY_INLINE void add_block(const Block& block, const SpatialInertiaSums& part, SpatialInertiaSums& sums) {
  const Doubles d;
  const double weight = block.weight < 0.0 ? 1.0 : block.weight;
  const VD step = hn::Set(d, weight * block.step_m),
           square = hn::Set(d, weight * block.step_m * block.step_m);
  const VD m = hn::Mul(hn::Set(d, weight), part.s[0]);
  VD c[3], about_centre[3], moment[3];
  for (int k = 0; k < 3; ++k) {
    c[k] = hn::Set(d, block.centre_m[k]);
    about_centre[k] = hn::Mul(step, part.s[k + 1]);
    moment[k] = hn::MulAdd(c[k], m, about_centre[k]);
    sums.s[k + 1] = hn::Add(sums.s[k + 1], moment[k]);
  }
  sums.s[0] = hn::Add(sums.s[0], m);
  for (int a = 0, at = 4; a < 3; ++a) {
    for (int b = a; b < 3; ++b, ++at)
      sums.s[at] = hn::MulAdd(square, part.s[at],
                              hn::MulAdd(c[a], about_centre[b], hn::MulAdd(moment[a], c[b], sums.s[at])));
  }
}

}  // namespace phantom::robot::kernel::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

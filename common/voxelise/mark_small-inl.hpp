// Private to mark_triangles.cpp, which includes it after mark_medium-inl.hpp, once for each instruction set
// (it has no guard): marks the small triangles of a fine mesh, one vector of them at a time.

#include <hwy/cache_control.h>
#include <hwy/highway.h>

#include <bit>
#include <cstddef>
#include <cstring>

#include "common/voxelise/snapped_mesh.hpp"

HWY_BEFORE_NAMESPACE();
namespace phantom::voxelise::detail::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// Marks small triangles, which span at most two voxels along each axis, and sorts out those that span a few
/// more (MediumTriangles) and all others. In coordinates from the corner of their first voxel, products of
/// two differences fit 32 bits: 2 · 32767² + 32767 · 32768 wraps where it is formed, but no value that is
/// compared does. The thirteen separating directions are those of larger triangles (mark_triangles.cpp),
/// applied to all eight voxels.
class SmallTriangles {
 public:
  SmallTriangles(const SnappedMesh& mesh, Slab slab, workspace::BitVolume& boundary)
      : points_(mesh.points),
        slab_(slab),
        size_(boundary.size()),
        words_(boundary.words().data()),
        row_words_(boundary.words_per_row()),
        layer_words_(row_words_ * static_cast<std::size_t>(size_[1])),
        counted_in_32_bits_(boundary.words().size() <= 0xffffffffU) {}

  static constexpr std::size_t kMax = kMaxLanes;
  static std::size_t at_once() { return hn::Lanes(kInts); }  ///< number of triangles per call, at most kMax

  /// Marks the voxels of the small ones among at_once() triangles. For triangles that span up to eight voxels
  /// along each axis, calls tile(bits, x, y, z) with the voxels that they meet in the tile at (x, y, z).
  /// Calls other(triangle) for triangles that span more, or reach beyond the slab or the volume. Writes into
  /// `over`, which has room for all, the numbers of those among the first `valid` triangles that reach over
  /// centres of the slab along y and z. Returns how many they are. `number`: of the first triangle.
  template <class Tile, class Other>
  std::size_t mark(const Corners* triangles, std::uint32_t number, std::size_t valid, std::uint32_t* over,
                   const Tile& tile, const Other& other) {
    load_corners(
        points_, [triangles](std::size_t lane) HWY_ATTR { return triangles[lane]; }, at_);
    const std::size_t reached = put_those_over_centres(number, valid, over);
    const Ints spanned = spanned_voxels();
    ask_for_rows();
    if (lanes_of_[kSmall] != 0) {
      hn::Store(hn::And(spanned, met_by_projections()), kInts, met_);
      keep_what_planes_pass();
    }
    for_each_lane(lanes_of_[kSmall], [this](std::size_t lane) HWY_ATTR { put(lane); });
    if (lanes_of_[kMedium] != 0) medium_.prepare(at_, at_once());
    for_each_lane(lanes_of_[kMedium], [&](std::size_t lane) HWY_ATTR { put_medium(lane, tile); });
    for_each_lane(lanes_of_[kOther], [&](std::size_t lane) HWY_ATTR { other(triangles[lane]); });
    return reached;
  }

 private:
  static constexpr hn::ScalableTag<double> kDoubles{};
  using Ints = hn::Vec<hn::ScalableTag<std::int32_t>>;
  static constexpr std::int32_t kOther = 0, kMedium = 1, kSmall = 2, kOutside = 3;
  static_assert(kMaxLanes <= 64);

  /// Processes one kind after the other, because branches on the kind of each triangle are unpredictable.
  template <class Visit>
  HWY_INLINE static void for_each_lane(std::uint64_t lanes, const Visit& visit) {
    for (; lanes != 0; lanes &= lanes - 1) visit(static_cast<std::size_t>(std::countr_zero(lanes)));
  }

  HWY_INLINE std::size_t put_those_over_centres(std::uint32_t number, std::size_t valid,
                                                std::uint32_t* over) const {
    constexpr std::int32_t kHalf = static_cast<std::int32_t>(kSub / 2);
    const std::int32_t least[3] = {0, 0, slab_.first}, most[3] = {0, size_[1] - 1, slab_.last - 1};
    auto reaches = hn::FirstN(kInts, valid);
    for (std::size_t axis = 1; axis < 3; ++axis) {
      const auto a = hn::Load(kInts, at_[0][axis]), b = hn::Load(kInts, at_[1][axis]),
                 c = hn::Load(kInts, at_[2][axis]);
      const auto low = hn::Add(hn::Min(a, hn::Min(b, c)), hn::Set(kInts, kHalf - 1)),
                 high = hn::Sub(hn::Max(a, hn::Max(b, c)), hn::Set(kInts, kHalf));
      const auto first = hn::Max(hn::ShiftRight<kSubBits>(low), hn::Set(kInts, least[axis])),
                 last = hn::Min(hn::ShiftRight<kSubBits>(high), hn::Set(kInts, most[axis]));
      reaches = hn::And(reaches, hn::Not(hn::Gt(first, last)));
    }
    const hn::RebindToUnsigned<decltype(kInts)> numbers;
    hn::StoreU(hn::Compress(hn::Iota(numbers, number), hn::RebindMask(numbers, reaches)), numbers, over);
    return hn::CountTrue(kInts, reaches);
  }

  /// Returns eight bits per triangle, 4 z + 2 y + x: the voxels of the box around it, or 0 if it is not
  /// small. Moves the corners' origin to where the box begins.
  HWY_INLINE Ints spanned_voxels() {
    // The voxels that remain without the second one along x, y, z.
    constexpr std::int32_t kWithout[3] = {0x55, 0x33, 0x0f};
    const std::int32_t least[3] = {0, 0, slab_.first};
    const std::int32_t most[3] = {size_[0] - 1, size_[1] - 1, slab_.last - 1};
    auto voxels = hn::Set(kInts, 0xff), kind = hn::Set(kInts, kSmall);
    auto outside = hn::Lt(kind, hn::Zero(kInts));  // none
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto a = hn::Load(kInts, at_[0][axis]), b = hn::Load(kInts, at_[1][axis]),
                 c = hn::Load(kInts, at_[2][axis]);
      const auto first = hn::ShiftRight<kSubBits>(hn::Min(a, hn::Min(b, c)));
      const auto last = hn::ShiftRight<kSubBits>(hn::Max(a, hn::Max(b, c)));
      const auto low = hn::Set(kInts, least[axis]), high = hn::Set(kInts, most[axis]);
      const auto medium = hn::Gt(last, hn::Add(first, hn::Set(kInts, 1)));
      const auto other = hn::Or(hn::Gt(last, hn::Add(first, hn::Set(kInts, 7))),
                                hn::Or(hn::Lt(first, low), hn::Gt(last, high)));
      kind = hn::IfThenElse(medium, hn::Min(kind, hn::Set(kInts, kMedium)), kind);
      kind = hn::IfThenElseZero(hn::Not(other), kind);
      outside = hn::Or(outside, hn::Or(hn::Lt(last, low), hn::Gt(first, high)));
      voxels = hn::IfThenElse(hn::Eq(first, last), hn::And(voxels, hn::Set(kInts, kWithout[axis])), voxels);
      hn::Store(first, kInts, first_[axis]);
      hn::Store(last, kInts, last_[axis]);
      const auto corner = hn::ShiftLeft<kSubBits>(first);
      hn::Store(hn::Sub(a, corner), kInts, at_[0][axis]);
      hn::Store(hn::Sub(b, corner), kInts, at_[1][axis]);
      hn::Store(hn::Sub(c, corner), kInts, at_[2][axis]);
    }
    if (!counted_in_32_bits_) kind = hn::Zero(kInts);
    kind = hn::IfThenElse(outside, hn::Set(kInts, kOutside), kind);
    for (const std::int32_t each : {kOther, kMedium, kSmall}) {
      std::uint8_t bits[8] = {};
      hn::StoreMaskBits(kInts, hn::Eq(kind, hn::Set(kInts, each)), bits);
      std::memcpy(&lanes_of_[each], bits, sizeof bits);
    }
    find_first_words();
    return hn::IfThenElseZero(hn::Eq(kind, hn::Set(kInts, kSmall)), voxels);
  }

  /// Returns a number per square 2 v + u of the plane (u, v): negative where the triangle's projection (its
  /// projection) does not meet the square.
  HWY_INLINE void projection(std::size_t u, std::size_t v, Ints outside[4]) const {
    const auto minus = [&](std::size_t to, std::size_t from, std::size_t axis) HWY_ATTR {
      return hn::Sub(hn::Load(kInts, at_[to][axis]), hn::Load(kInts, at_[from][axis]));
    };
    const auto zero = hn::Zero(kInts);
    const auto area =
        hn::Sub(hn::Mul(minus(1, 0, u), minus(2, 0, v)), hn::Mul(minus(2, 0, u), minus(1, 0, v)));
    const auto turned = hn::Lt(area, zero);
    for (std::size_t i = 0; i < 3; ++i) {
      const std::size_t next = (i + 1) % 3;
      auto du = minus(next, i, u), dv = minus(next, i, v);
      du = hn::IfThenElse(turned, hn::Neg(du), du);
      dv = hn::IfThenElse(turned, hn::Neg(dv), dv);
      const auto step_u = hn::Neg(hn::ShiftLeft<kSubBits>(dv)), step_v = hn::ShiftLeft<kSubBits>(du);
      const auto from =
          hn::Sub(hn::Mul(dv, hn::Load(kInts, at_[i][u])), hn::Mul(du, hn::Load(kInts, at_[i][v])));
      const auto first = hn::Add(from, hn::Add(hn::Max(zero, step_u), hn::Max(zero, step_v)));
      const auto above = hn::Add(first, step_v);
      const Ints values[4] = {first, hn::Add(first, step_u), above, hn::Add(above, step_u)};
      for (std::size_t square = 0; square < 4; ++square)
        outside[square] = i == 0 ? values[square] : hn::Or(outside[square], values[square]);
    }
  }

  HWY_INLINE Ints met_by_projections() const {
    Ints xy[4], yz[4], xz[4];
    projection(0, 1, xy);
    projection(1, 2, yz);
    projection(0, 2, xz);
    auto met = hn::Zero(kInts);
    for (std::size_t voxel = 0; voxel < 8; ++voxel) {
      const std::size_t x = voxel & 1, y = voxel >> 1 & 1, z = voxel >> 2;
      const auto outside = hn::Or(xy[2 * y + x], hn::Or(yz[2 * z + y], xz[2 * z + x]));
      const auto bit = hn::Set(kInts, std::int32_t{1} << voxel);
      met = hn::Or(met, hn::AndNot(hn::BroadcastSignBit(outside), bit));
    }
    return met;
  }

  /// Keeps the voxels through which the triangle's plane passes. Its values are whole numbers below 2⁴⁸,
  /// which a double represents exactly.
  HWY_INLINE void keep_what_planes_pass() {
    const hn::Rebind<std::int32_t, decltype(kDoubles)> ints;
    const auto zero = hn::Zero(kDoubles), edge = hn::Set(kDoubles, static_cast<double>(kSub));
    for (std::size_t lane = 0; lane < at_once(); lane += hn::Lanes(kDoubles)) {
      const auto load = [&](const std::int32_t* from)
                            HWY_ATTR { return hn::PromoteTo(kDoubles, hn::Load(ints, from + lane)); };
      hn::Vec<decltype(kDoubles)> b[3], c[3], step[3];
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto from = load(at_[0][axis]);
        b[axis] = hn::Sub(load(at_[1][axis]), from);
        c[axis] = hn::Sub(load(at_[2][axis]), from);
      }
      auto low = zero, span = zero;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const std::size_t j = (axis + 1) % 3, k = (axis + 2) % 3;
        const auto normal = hn::Sub(hn::Mul(b[j], c[k]), hn::Mul(b[k], c[j]));
        step[axis] = hn::Mul(normal, edge);
        low = hn::Sub(low, hn::Mul(normal, load(at_[0][axis])));
        low = hn::Add(low, hn::Min(zero, step[axis]));
        span = hn::Add(span, hn::Abs(step[axis]));
      }
      auto passes = hn::Zero(kDoubles);  // a sum of powers of two
      for (std::size_t voxel = 0; voxel < 8; ++voxel) {
        auto value = low;
        for (std::size_t axis = 0; axis < 3; ++axis) {
          if ((voxel >> axis & 1) != 0) value = hn::Add(value, step[axis]);
        }
        const auto meets = hn::And(hn::Le(value, zero), hn::Ge(hn::Add(value, span), zero));
        passes =
            hn::Add(passes, hn::IfThenElseZero(meets, hn::Set(kDoubles, static_cast<double>(1 << voxel))));
      }
      hn::Store(hn::And(hn::DemoteTo(ints, passes), hn::Load(ints, met_ + lane)), ints, met_ + lane);
    }
  }

  /// Finds the words that hold the triangles' first voxels, if these are within the volume.
  HWY_INLINE void find_first_words() {
    const hn::RebindToUnsigned<decltype(kInts)> numbers;
    const auto at = [&](std::size_t axis)
                        HWY_ATTR { return hn::BitCast(numbers, hn::Load(kInts, first_[axis])); };
    const auto row = hn::Add(hn::Mul(at(2), hn::Set(numbers, static_cast<std::uint32_t>(size_[1]))), at(1));
    hn::Store(hn::Add(hn::Mul(row, hn::Set(numbers, static_cast<std::uint32_t>(row_words_))),
                      hn::ShiftRight<6>(at(0))),
              numbers, word_);
  }

  /// Prefetches the rows of medium triangles; writing those of small ones does not make the processor wait.
  /// (Always inlined: GCC would remove a function that only prefetches, as one without effect.)
  HWY_INLINE void ask_for_rows() const {
    for (std::uint64_t lanes = lanes_of_[kMedium]; lanes != 0; lanes &= lanes - 1) {
      const auto lane = static_cast<std::size_t>(std::countr_zero(lanes));
      const std::uint64_t* word = words_ + word_[lane];
      const std::int32_t rows = std::min(last_[1][lane] - first_[1][lane], 3),
                         layers = std::min(last_[2][lane] - first_[2][lane], 3);
      for (std::int32_t z = 0; z <= layers; ++z, word += layer_words_) {
        for (std::int32_t y = 0; y <= rows; ++y)
          hwy::Prefetch(word + static_cast<std::size_t>(y) * row_words_);
      }
    }
  }

  template <class Tile>
  HWY_INLINE void put_medium(std::size_t lane, const Tile& tile) const {
    const std::int32_t x = first_[0][lane], y = first_[1][lane], z = first_[2][lane];
    const Range range[3] = {{0, last_[0][lane] - x}, {0, last_[1][lane] - y}, {0, last_[2][lane] - z}};
    for (std::int32_t dz = 0; dz <= range[2].last; dz += kTile) {
      for (std::int32_t dy = 0; dy <= range[1].last; dy += kTile) {
        const std::uint64_t yz = nibbles(medium_.squares(1, lane, dy, dz));
        if (yz == 0) continue;
        for (std::int32_t dx = 0; dx <= range[0].last; dx += kTile) {
          const std::uint64_t met = medium_.squares(0, lane, dx, dy) * 0x0001000100010001ULL & yz &
                                    nibble_runs(medium_.squares(2, lane, dx, dz)) & within(dx, dy, dz, range);
          if (met != 0) tile(met & medium_.passed(lane, dx, dy, dz), x + dx, y + dy, z + dz);
        }
      }
    }
  }

  /// Number of words from a small triangle's first row to its second one and to the layer above; 0 if its box
  /// does not reach there.
  struct Rows {
    std::size_t second, layer;
  };
  HWY_INLINE Rows rows_of(std::size_t lane) const {
    return {last_[1][lane] > first_[1][lane] ? row_words_ : 0,
            last_[2][lane] > first_[2][lane] ? layer_words_ : 0};
  }

  /// Writes all four rows, met or not, because branches on that are unpredictable.
  HWY_INLINE void put(std::size_t lane) {
    const int shift = first_[0][lane] & 63;
    const auto met = static_cast<std::uint64_t>(met_[lane]);
    const Rows rows = rows_of(lane);
    std::uint64_t* const below = words_ + word_[lane];
    std::uint64_t* const above = below + rows.layer;
    below[0] |= (met & 3) << shift;
    below[rows.second] |= (met >> 2 & 3) << shift;
    above[0] |= (met >> 4 & 3) << shift;
    above[rows.second] |= met >> 6 << shift;
    if (shift == 63 && (met & 0xaa) != 0) put_second_column(met, below, rows.second, above);
  }
  static void put_second_column(std::uint64_t met, std::uint64_t* below, std::size_t row,
                                std::uint64_t* above) {
    below[1] |= met >> 1 & 1;
    below[row + 1] |= met >> 3 & 1;
    above[1] |= met >> 5 & 1;
    above[row + 1] |= met >> 7 & 1;
  }

  const std::vector<SnappedPoint>& points_;
  Slab slab_;
  std::array<std::int32_t, 3> size_;
  std::uint64_t* words_;
  std::size_t row_words_, layer_words_;
  bool counted_in_32_bits_;  // whether the volume's words can be; from 32 GiB on, every triangle counts as
                             // other
  MediumTriangles medium_;
  alignas(64) CornerLanes at_;
  alignas(64) std::int32_t first_[3][kMax], last_[3][kMax], met_[kMax] = {};
  std::uint64_t lanes_of_[3] = {};  // by kind, one bit per lane
  alignas(64) std::uint32_t word_[kMax];
};

}  // namespace phantom::voxelise::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

// Private to banded_distance.cpp: its second and third pass, where one instruction looks up many bytes in a
// table. Compiled once per instruction set.

#if defined(PHANTOM_VOXEL_BANDED_RANKS_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef PHANTOM_VOXEL_BANDED_RANKS_INL
#undef PHANTOM_VOXEL_BANDED_RANKS_INL
#else
#define PHANTOM_VOXEL_BANDED_RANKS_INL
#endif

#include "common/voxel/banded_lines-inl.hpp"

#if HWY_TARGET == HWY_AVX3_DL
HWY_BEFORE_NAMESPACE();
namespace phantom::voxel::detail::HWY_NAMESPACE {
// Bytes say it all: squares are told apart only as far as it matters for the order in the end
// (BandedDistance::Ranks).

using Bytes = hn::Vec<decltype(kBytes)>;

HWY_INLINE Bytes look_up_64(const std::uint8_t* table, Bytes index) {
  return Bytes{_mm512_permutexvar_epi8(index.raw, _mm512_load_si512(table))};
}
HWY_INLINE Bytes look_up_128(const std::uint8_t* table, Bytes index) {
  return Bytes{_mm512_permutex2var_epi8(_mm512_load_si512(table), index.raw, _mm512_load_si512(table + 64))};
}
HWY_INLINE std::uint8_t least_of(Bytes bytes) {
  const __m256i half =
      _mm256_min_epu8(_mm512_castsi512_si256(bytes.raw), _mm512_extracti64x4_epi64(bytes.raw, 1));
  const __m128i quarter = _mm_min_epu8(_mm256_castsi256_si128(half), _mm256_extracti128_si256(half, 1));
  return static_cast<std::uint8_t>(
      _mm_cvtsi128_si32(_mm_minpos_epu16(_mm_min_epu8(quarter, _mm_srli_epi16(quarter, 8)))));
}

/// As nearest(), for ranks or classes: `so_far` and what look_up(table of k, better of the neighbours at ±k)
/// says, the least of all; `bound`: what the best neighbour of all would be, by table. Tables of kTable
/// bytes, one for each k.
template <std::size_t kTable, class Better, class LookUp>
HWY_INLINE Bytes least_of_neighbours(Bytes so_far, const std::uint8_t* centre, std::ptrdiff_t stride,
                                     Offsets offsets, const std::uint8_t* tables, std::uint8_t bound,
                                     const Better& better, const LookUp& look_up) {
  const std::uint8_t *before = centre - offsets.first * stride, *behind = centre + offsets.first * stride;
  const std::uint8_t* table = tables + static_cast<std::size_t>(offsets.first) * kTable;
  for (int k = offsets.first; k <= offsets.last; k += static_cast<int>(kMoreOffsets) + 1) {
    if (hn::AllTrue(kBytes, hn::Eq(so_far, hn::Min(so_far, hn::Set(kBytes, table[bound]))))) break;
    for (std::size_t more = 0; more <= kMoreOffsets; ++more) {
      so_far = hn::Min(so_far, look_up(table, better(hn::LoadU(kBytes, before), hn::LoadU(kBytes, behind))));
      before -= stride;
      behind += stride;
      table += kTable;
    }
  }
  return so_far;
}

/// 64 bits from bit `at` on.
HWY_INLINE std::uint64_t bits_from(const std::uint64_t* words, std::ptrdiff_t at) {
  const std::ptrdiff_t word = at >> 6;
  const int shift = static_cast<int>(at & 63);
  return shift == 0 ? words[word] : words[word] >> shift | words[word + 1] << (64 - shift);
}

/// How far `length` (≤ 64) places from `at` on are from the nearest bit that is set: 0 if one of them is,
/// more than 64 if none is that near.
HWY_INLINE int nearest_bit(const std::uint64_t* words, std::size_t at, std::size_t length) {
  const auto from = static_cast<std::ptrdiff_t>(at), to = from + static_cast<std::ptrdiff_t>(length);
  if (bits_from(words, from) << (64 - length) != 0) return 0;
  return std::min(std::countl_zero(bits_from(words, from - 64)), std::countr_zero(bits_from(words, to))) + 1;
}

/// Ranks of row y in the plane y, z; false if all are out of the band.
bool ranks_along_y(const Extent& e, BandedDistance& work, std::size_t y, std::size_t z) {
  const BandedDistance::Ranks& ranks = work.ranks;
  const auto stride = static_cast<std::ptrdiff_t>(e.length);
  const std::uint8_t* row = work.closeness.data() + z * e.slice + (y + e.reach + kMoreOffsets) * e.length;
  const int at = static_cast<int>(y + e.reach);
  const auto far = hn::Set(kBytes, ranks.far);
  std::uint64_t any = 0;
  for (std::size_t x = 0, i = 0; x < e.used; x += kPad, ++i) {
    const RowsOfColumns& columns = work.columns[i];
    if (!columns.wanted) continue;
    const int nearest = nearest_bit(columns.bits.data() + 1, y + e.reach, 1);
    const Offsets offsets{std::max(1, nearest),
                          std::min<int>(ranks.reach_of_closeness[columns.most],
                                        std::max(at - columns.span.first, columns.span.last - at))};
    auto best = far;
    if (nearest == 0 || offsets.first <= offsets.last) {
      best = least_of_neighbours<64>(
          look_up_64(ranks.of_closeness.data(), hn::LoadU(kBytes, row + x)), row + x, stride, offsets,
          ranks.of_closeness.data(), columns.most, [](Bytes a, Bytes b) HWY_ATTR { return hn::Max(a, b); },
          [](const std::uint8_t* table, Bytes index) HWY_ATTR { return look_up_64(table, index); });
    }
    hn::StoreU(best, kBytes, work.rank_line.data() + kPad + x);
    const std::uint64_t bits = _cvtmask64_u64(_mm512_cmpneq_epu8_mask(best.raw, far.raw));
    work.in_band[1 + i] = bits;
    any |= bits;
  }
  return any != 0;
}

/// Orders of a row from its ranks in the plane y, z; of its bricks that are wanted.
void orders_from_ranks(const Extent& e, const BrickBlock& block, std::int8_t* const* bricks,
                       BandedDistance& work) {
  const BandedDistance::Ranks& ranks = work.ranks;
  const auto reach = static_cast<std::ptrdiff_t>(e.reach);
  for (std::size_t x = 0; x < e.nx; x += kPad) {
    const std::size_t brick = x / kBrickEdge;
    if (bricks[brick] == nullptr &&
        (brick + 1 == static_cast<std::size_t>(block.nx) || bricks[brick + 1] == nullptr))
      continue;
    std::uint8_t* const orders = work.orders.data() + x;
    const std::size_t first = e.halo + x;
    const std::uint8_t* centre = work.rank_line.data() + kPad + first;
    const int nearest = nearest_bit(work.in_band.data() + 1, first, kPad);
    if (nearest > static_cast<int>(e.reach)) {
      std::memset(orders, static_cast<std::uint8_t>(work.steps().order.back()), kPad);
      continue;
    }
    const auto own = hn::LoadU(kBytes, centre);
    const std::uint8_t least =
        least_of(hn::Min(own, hn::Min(hn::LoadU(kBytes, centre - reach), hn::LoadU(kBytes, centre + reach))));
    const auto best = least_of_neighbours<128>(
        look_up_128(ranks.classes.data(), own), centre, 1, {std::max(1, nearest), ranks.reach_of_rank[least]},
        ranks.classes.data(), least, [](Bytes a, Bytes b) HWY_ATTR { return hn::Min(a, b); },
        [](const std::uint8_t* table, Bytes index) HWY_ATTR { return look_up_128(table, index); });
    hn::StoreU(look_up_64(ranks.orders.data(), best), kBytes, orders);
  }
}

/// Looks at the columns of a slice; false if they are all out of the band.
bool look_at_columns(const Extent& e, BandedDistance& work, std::size_t z) {
  bool any = false;
  const auto zero = hn::Zero(kBytes), all_ones = hn::Set(kBytes, std::uint8_t{255});
  for (std::size_t x = 0, i = 0; x < e.used; x += kPad, ++i) {
    RowsOfColumns& columns = work.columns[i];
    if (!columns.wanted) continue;
    columns.span = {};
    columns.bits = {};
    const std::uint8_t* closeness = work.closeness.data() + z * e.slice + kMoreOffsets * e.length + x;
    auto most = zero;
    for (std::size_t y = 0; y < e.rows; ++y, closeness += e.length) {
      const auto row = hn::LoadU(kBytes, closeness);
      most = hn::Max(most, row);
      if (hn::AllTrue(kBytes, hn::Eq(row, zero))) continue;
      columns.span.add({static_cast<int>(y), static_cast<int>(y)});
      columns.bits[1 + y / 64] |= std::uint64_t{1} << (y % 64);
    }
    columns.most = static_cast<std::uint8_t>(255 - least_of(hn::Xor(most, all_ones)));
    any = any || !columns.span.empty();
  }
  return any;
}

}  // namespace phantom::voxel::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif  // HWY_AVX3_DL

#endif

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

/// Rows that lie side by side along y are worked on together: those of a tile of the workspace's bricks. What
/// is looked up and decided once then serves all of them.
constexpr std::size_t kRowsAtOnce = 4;
using Rows = Bytes[kRowsAtOnce];

HWY_INLINE Bytes least_row(const Rows& rows) {
  return hn::Min(hn::Min(rows[0], rows[1]), hn::Min(rows[2], rows[3]));
}
HWY_INLINE Bytes greatest_row(const Rows& rows) {
  return hn::Max(hn::Max(rows[0], rows[1]), hn::Max(rows[2], rows[3]));
}

/// As nearest(), for ranks or classes, in rows that begin at `centre` and each `row` further on: the least of
/// `so_far` and what look_up(table of k, better of the neighbours at ±k·stride) says; `bound`: what the best
/// neighbour of all would be, by table. Tables of kTable bytes, one for each k.
template <std::size_t kTable, class Better, class LookUp>
HWY_INLINE void least_of_neighbours(Rows& so_far, const std::uint8_t* centre, std::ptrdiff_t row,
                                    std::ptrdiff_t stride, Offsets offsets, const std::uint8_t* tables,
                                    std::uint8_t bound, const Better& better, const LookUp& look_up) {
  const std::uint8_t *before = centre - offsets.first * stride, *behind = centre + offsets.first * stride;
  const std::uint8_t* table = tables + static_cast<std::size_t>(offsets.first) * kTable;
  for (int k = offsets.first; k <= offsets.last; k += static_cast<int>(kMoreOffsets) + 1) {
    const auto farthest = greatest_row(so_far);
    if (hn::AllTrue(kBytes, hn::Eq(farthest, hn::Min(farthest, hn::Set(kBytes, table[bound]))))) break;
    for (std::size_t more = 0; more <= kMoreOffsets; ++more) {
      for (std::size_t r = 0; r < kRowsAtOnce; ++r) {
        const auto away = static_cast<std::ptrdiff_t>(r) * row;
        const auto nearer = better(hn::LoadU(kBytes, before + away), hn::LoadU(kBytes, behind + away));
        so_far[r] = hn::Min(so_far[r], look_up(table, nearer));
      }
      before -= stride;
      behind += stride;
      table += kTable;
    }
  }
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

/// Ranks of the rows from y on in the plane y, z; false if all are out of the band.
bool ranks_along_y(const Extent& e, BandedDistance& work, std::size_t y, std::size_t z) {
  const BandedDistance::Ranks& ranks = work.ranks;
  const auto stride = static_cast<std::ptrdiff_t>(e.length);
  const std::uint8_t* first = work.closeness.data() + z * e.slice + (y + e.reach + kMoreOffsets) * e.length;
  const int at = static_cast<int>(y + e.reach), last = at + static_cast<int>(kRowsAtOnce) - 1;
  const auto far = hn::Set(kBytes, ranks.far);
  std::uint64_t any = 0;
  for (std::size_t x = 0, i = 0; x < e.used; x += kPad, ++i) {
    const RowsOfColumns& columns = work.columns[i];
    if (!columns.wanted) continue;
    const int nearest = nearest_bit(columns.bits->data() + 1, y + e.reach, kRowsAtOnce);
    const Offsets offsets{std::max(1, nearest),
                          std::min<int>(ranks.reach_of_closeness[columns.most],
                                        std::max(last - columns.span.first, columns.span.last - at))};
    Rows best{far, far, far, far};
    if (nearest == 0 || offsets.first <= offsets.last) {
      for (std::size_t r = 0; r < kRowsAtOnce; ++r)
        best[r] = look_up_64(ranks.of_closeness.data(), hn::LoadU(kBytes, first + x + r * e.length));
      least_of_neighbours<64>(
          best, first + x, stride, stride, offsets, ranks.of_closeness.data(), columns.most,
          [](Bytes a, Bytes b) HWY_ATTR { return hn::Max(a, b); },
          [](const std::uint8_t* table, Bytes index) HWY_ATTR { return look_up_64(table, index); });
    }
    for (std::size_t r = 0; r < kRowsAtOnce; ++r)
      hn::StoreU(best[r], kBytes, work.rank_lines.data() + r * e.rank_line + kPad + x);
    const std::uint64_t bits = _cvtmask64_u64(_mm512_cmpneq_epu8_mask(least_row(best).raw, far.raw));
    work.in_band[1 + i] = bits;
    any |= bits;
  }
  return any != 0;
}

/// Puts 64 orders of each row into two bricks, from `offset` on; null: not wanted.
HWY_INLINE void put_rows(const Rows& rows, std::int8_t* const* bricks, std::size_t offset) {
  // Of the rows' words of four voxels, those of one tile side by side, as they stand there: tiles c, c + 4, c
  // + 8 and c + 12 in the c-th vector.
  const __m512i low_a = _mm512_unpacklo_epi32(rows[0].raw, rows[1].raw),
                low_b = _mm512_unpacklo_epi32(rows[2].raw, rows[3].raw),
                high_a = _mm512_unpackhi_epi32(rows[0].raw, rows[1].raw),
                high_b = _mm512_unpackhi_epi32(rows[2].raw, rows[3].raw);
  const __m512i tiles[4] = {_mm512_unpacklo_epi64(low_a, low_b), _mm512_unpackhi_epi64(low_a, low_b),
                            _mm512_unpacklo_epi64(high_a, high_b), _mm512_unpackhi_epi64(high_a, high_b)};
  for (std::size_t c = 0; c < 4; ++c) {
    const auto put = [&](std::int8_t* brick, std::size_t tile, __m128i part) HWY_ATTR {
      _mm_storeu_si128(reinterpret_cast<__m128i*>(brick + offset + 64 * tile), part);
    };
    if (bricks[0] != nullptr) {
      put(bricks[0], c, _mm512_castsi512_si128(tiles[c]));
      put(bricks[0], c + 4, _mm512_extracti32x4_epi32(tiles[c], 1));
    }
    if (bricks[1] != nullptr) {
      put(bricks[1], c, _mm512_extracti32x4_epi32(tiles[c], 2));
      put(bricks[1], c + 4, _mm512_extracti32x4_epi32(tiles[c], 3));
    }
  }
}

/// Orders of 64 voxels of each row, which begin at `first`, from the rows' ranks in the plane y, z; false if
/// all are out of the band.
HWY_INLINE bool orders_from_ranks(const Extent& e, const BandedDistance& work, std::size_t x, Index3 first,
                                  Rows& orders) {
  const BandedDistance::Ranks& ranks = work.ranks;
  const auto reach = static_cast<std::ptrdiff_t>(e.reach), row = static_cast<std::ptrdiff_t>(e.rank_line);
  const std::uint8_t* centre = work.rank_lines.data() + kPad + e.halo + x;
  const int nearest = nearest_bit(work.in_band.data() + 1, e.halo + x, kPad);
  if (nearest > static_cast<int>(e.reach)) return false;
  Rows own, around;
  for (std::size_t r = 0; r < kRowsAtOnce; ++r) {
    const std::uint8_t* here = centre + static_cast<std::ptrdiff_t>(r) * row;
    own[r] = hn::LoadU(kBytes, here);
    around[r] = hn::Min(own[r], hn::Min(hn::LoadU(kBytes, here - reach), hn::LoadU(kBytes, here + reach)));
  }
  const std::uint8_t least = least_of(least_row(around));
  for (std::size_t r = 0; r < kRowsAtOnce; ++r) orders[r] = look_up_128(ranks.classes.data(), own[r]);
  least_of_neighbours<128>(
      orders, centre, row, 1, {std::max(1, nearest), ranks.reach_of_rank[least]}, ranks.classes.data(), least,
      [](Bytes a, Bytes b) HWY_ATTR { return hn::Min(a, b); },
      [](const std::uint8_t* table, Bytes index) HWY_ATTR { return look_up_128(table, index); });
  const __m512i boundary = _mm512_set1_epi8(kOrderBoundary);
  for (std::size_t r = 0; r < kRowsAtOnce; ++r) {
    orders[r] = look_up_64(ranks.orders.data(), orders[r]);
    if (least != 0) continue;
    const std::uint64_t bits =
        work.solid().boundary(first.x, first.y + static_cast<std::int32_t>(r), first.z);
    orders[r].raw = _mm512_mask_mov_epi8(orders[r].raw, bits, boundary);
  }
  return true;
}

/// The rows from y on of one slice, into the bricks; `in_band`: whether any of the slice is.
void rows_of_slice(const Extent& e, const BrickBlock& block, std::size_t y, std::size_t z, bool in_band,
                   BandedDistance& work) {
  const bool any = in_band && ranks_along_y(e, work, y, z);
  const std::size_t offset =
      brick_offset(0, static_cast<std::uint32_t>(y % kBrickEdge), static_cast<std::uint32_t>(z % kBrickEdge));
  const auto beyond = hn::Set(kBytes, static_cast<std::uint8_t>(work.steps().order.back()));
  std::int8_t* const* const bricks = bricks_at(block, y, z);
  const auto count = static_cast<std::size_t>(block.nx);
  for (std::size_t brick = 0; brick < count; brick += 2) {
    std::int8_t* const here[2] = {bricks[brick], brick + 1 < count ? bricks[brick + 1] : nullptr};
    if (here[0] == nullptr && here[1] == nullptr) continue;
    const std::size_t x = brick * kBrickEdge;
    Index3 first = voxel_of(block, y, z);
    first.x += static_cast<std::int32_t>(x);
    Rows orders;
    if (!any || !orders_from_ranks(e, work, x, first, orders)) {
      for (auto& row : orders) row = beyond;
    }
    put_rows(orders, here, offset);
  }
}

constexpr std::size_t kRowsNoted = 16;  // rows whose greatest closeness is known together
static_assert(kBrickEdge % kRowsNoted == 0);
std::size_t row_parts(const Extent& e) { return (e.rows + kRowsNoted - 1) / kRowsNoted; }

/// Notes rows of distances along z as they come.
class RowNotes {
 public:
  RowNotes(const Extent& e, BandedDistance& work)
      : vectors_(e.length / kPad), parts_(row_parts(e)), ny_(e.ny), work_(work) {
    work.row_bits.resize(e.nz * vectors_);
    work.most_in_rows.resize(e.nz * vectors_ * parts_ * kPad);
  }

  /// The first `known` rows are those that followed after the first block's rows last time.
  void keep(std::size_t known) {
    const std::size_t count = work_.row_bits.size(), gone = ny_ / kRowsNoted;
    if (known == 0) {
      work_.row_bits.assign(count, RowBits{});
      std::fill(work_.most_in_rows.begin(), work_.most_in_rows.end(), 0);
      return;
    }
    for (std::size_t i = 0; i < count; ++i) {
      RowBits& bits = work_.row_bits[i];
      for (std::size_t word = 1; word + 1 < bits.size(); ++word)
        bits[word] = bits_from(bits.data() + word, static_cast<std::ptrdiff_t>(ny_));
      std::uint8_t* const most = work_.most_in_rows.data() + i * parts_ * kPad;
      std::memmove(most, most + gone * kPad, (parts_ - gone) * kPad);
      std::memset(most + (parts_ - gone) * kPad, 0, gone * kPad);
    }
  }
  HWY_INLINE void add(std::size_t x, std::size_t y, std::size_t z, Bytes close) {
    const std::size_t at = z * vectors_ + x / kPad;
    const auto any = static_cast<std::uint64_t>(_mm512_test_epi8_mask(close.raw, close.raw) != 0);
    work_.row_bits[at][1 + y / 64] |= any << (y % 64);
    std::uint8_t* const most = work_.most_in_rows.data() + (at * parts_ + y / kRowsNoted) * kPad;
    hn::Store(hn::Max(hn::Load(kBytes, most), close), kBytes, most);
  }

 private:
  std::size_t vectors_, parts_, ny_;
  BandedDistance& work_;
};

/// Looks at the columns of a slice; false if they are all out of the band.
bool look_at_columns(const Extent& e, BandedDistance& work, std::size_t z) {
  bool any = false;
  const std::size_t parts = row_parts(e);
  for (std::size_t x = 0, i = 0; x < e.used; x += kPad, ++i) {
    RowsOfColumns& columns = work.columns[i];
    if (!columns.wanted) continue;
    const std::size_t at = z * (e.length / kPad) + i;
    columns.bits = &work.row_bits[at];
    columns.span = {};
    for (std::size_t word = 1; word + 1 < columns.bits->size(); ++word) {
      const std::uint64_t bits = (*columns.bits)[word];
      if (bits == 0) continue;
      const int first = static_cast<int>(word - 1) * 64;
      columns.span.add({first + std::countr_zero(bits), first + 63 - std::countl_zero(bits)});
    }
    if (columns.span.empty()) continue;
    const std::uint8_t* part = work.most_in_rows.data() + at * parts * kPad;
    auto most = hn::Load(kBytes, part);
    for (std::size_t k = 1; k < parts; ++k) most = hn::Max(most, hn::Load(kBytes, part + k * kPad));
    columns.most =
        static_cast<std::uint8_t>(255 - least_of(hn::Xor(most, hn::Set(kBytes, std::uint8_t{255}))));
    any = true;
  }
  return any;
}

}  // namespace phantom::voxel::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif  // HWY_AVX3_DL

#endif

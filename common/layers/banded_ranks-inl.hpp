// Private to banded_distance.cpp, which includes it after banded_lines-inl.hpp, once for each instruction set
// (it has no guard): its second and third pass, where one instruction looks up many bytes in a table.

#if HWY_TARGET == HWY_AVX3_DL
HWY_BEFORE_NAMESPACE();
namespace phantom::layers::detail::HWY_NAMESPACE {
// Works in bytes throughout: squares are distinguished only as far as the final order requires
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

/// Number of neighbouring rows along y that are processed together: the rows of a tile of the workspace's
/// bricks. Each look-up and decision then serves all of them.
constexpr std::size_t kRowsAtOnce = 4;
constexpr std::size_t kMinOf = 16;  // number of columns that share one least rank
template <std::size_t kCount>
using Vectors = Bytes[kCount];

template <std::size_t kCount>
HWY_INLINE Bytes least_vector(const Vectors<kCount>& vectors) {
  Bytes least = vectors[0];
  for (std::size_t i = 1; i < kCount; ++i) least = hn::Min(least, vectors[i]);
  return least;
}
template <std::size_t kCount>
HWY_INLINE Bytes greatest_vector(const Vectors<kCount>& vectors) {
  Bytes greatest = vectors[0];
  for (std::size_t i = 1; i < kCount; ++i) greatest = hn::Max(greatest, vectors[i]);
  return greatest;
}

/// Like nearest(), for ranks or classes, in vectors that begin at `centre` and every `next` after it. Sets
/// each vector to the least of `so_far` and look_up(table of k, better of the neighbours at ±k·stride).
/// `bound` is the table index of the best neighbour of all. `tables` holds kTable bytes for each k.
template <std::size_t kTable, std::size_t kCount, class Better, class LookUp>
HWY_INLINE void least_of_neighbours(Vectors<kCount>& so_far, const std::uint8_t* centre, std::ptrdiff_t next,
                                    std::ptrdiff_t stride, Offsets offsets, const std::uint8_t* tables,
                                    std::uint8_t bound, const Better& better, const LookUp& look_up) {
  const std::uint8_t *before = centre - offsets.first * stride, *behind = centre + offsets.first * stride;
  const std::uint8_t* table = tables + static_cast<std::size_t>(offsets.first) * kTable;
  for (int k = offsets.first; k <= offsets.last; k += static_cast<int>(kMoreOffsets) + 1) {
    const auto farthest = greatest_vector(so_far);
    if (hn::AllTrue(kBytes, hn::Eq(farthest, hn::Min(farthest, hn::Set(kBytes, table[bound]))))) break;
    for (std::size_t more = 0; more <= kMoreOffsets; ++more) {
      for (std::size_t i = 0; i < kCount; ++i) {
        const auto away = static_cast<std::ptrdiff_t>(i) * next;
        const auto nearer = better(hn::LoadU(kBytes, before + away), hn::LoadU(kBytes, behind + away));
        so_far[i] = hn::Min(so_far[i], look_up(table, nearer));
      }
      before -= stride;
      behind += stride;
      table += kTable;
    }
  }
}

/// Returns 64 bits from bit `at` on.
HWY_INLINE std::uint64_t bits_from(const std::uint64_t* words, std::ptrdiff_t at) {
  const std::ptrdiff_t word = at >> 6;
  const int shift = static_cast<int>(at & 63);
  return shift == 0 ? words[word] : words[word] >> shift | words[word + 1] << (64 - shift);
}

/// Returns the distance of the range of `length` (≤ 64) positions from `at` on to the nearest bit that is
/// set. It is 0 if one in the range is set, and more than 64 if none is that near.
HWY_INLINE int nearest_bit(const std::uint64_t* words, std::size_t at, std::size_t length) {
  const auto from = static_cast<std::ptrdiff_t>(at), to = from + static_cast<std::ptrdiff_t>(length);
  if (bits_from(words, from) << (64 - length) != 0) return 0;
  return std::min(std::countl_zero(bits_from(words, from - 64)), std::countr_zero(bits_from(words, to))) + 1;
}

/// Writes the ranks of 64 columns in four rows, column after column, and the least rank of each sixteen
/// columns, a byte each.
HWY_INLINE void put_columns(const Vectors<kRowsAtOnce>& rows, Bytes least, std::uint8_t* to,
                            std::uint32_t& least_of_16) {
  const __m512i low_a = _mm512_unpacklo_epi8(rows[0].raw, rows[1].raw),
                low_b = _mm512_unpacklo_epi8(rows[2].raw, rows[3].raw),
                high_a = _mm512_unpackhi_epi8(rows[0].raw, rows[1].raw),
                high_b = _mm512_unpackhi_epi8(rows[2].raw, rows[3].raw);
  // The first four columns of each sixteen, the second four, …
  const __m512i fours[4] = {_mm512_unpacklo_epi16(low_a, low_b), _mm512_unpackhi_epi16(low_a, low_b),
                            _mm512_unpacklo_epi16(high_a, high_b), _mm512_unpackhi_epi16(high_a, high_b)};
  const __m512i a = _mm512_shuffle_i32x4(fours[0], fours[1], 0x44),
                b = _mm512_shuffle_i32x4(fours[2], fours[3], 0x44),
                c = _mm512_shuffle_i32x4(fours[0], fours[1], 0xee),
                d = _mm512_shuffle_i32x4(fours[2], fours[3], 0xee);
  hn::StoreU(Bytes{_mm512_shuffle_i32x4(a, b, 0x88)}, kBytes, to);
  hn::StoreU(Bytes{_mm512_shuffle_i32x4(a, b, 0xdd)}, kBytes, to + 64);
  hn::StoreU(Bytes{_mm512_shuffle_i32x4(c, d, 0x88)}, kBytes, to + 128);
  hn::StoreU(Bytes{_mm512_shuffle_i32x4(c, d, 0xdd)}, kBytes, to + 192);
  __m512i m = _mm512_min_epu8(least.raw, _mm512_bsrli_epi128(least.raw, 8));
  m = _mm512_min_epu8(m, _mm512_bsrli_epi128(m, 4));
  m = _mm512_min_epu8(m, _mm512_bsrli_epi128(m, 2));
  m = _mm512_min_epu8(m, _mm512_bsrli_epi128(m, 1));
  const __m128i four = _mm512_cvtepi32_epi8(
      _mm512_permutexvar_epi32(_mm512_setr_epi32(0, 4, 8, 12, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0), m));
  least_of_16 = static_cast<std::uint32_t>(_mm_cvtsi128_si32(four));
}

/// Computes the ranks of kRowsAtOnce rows from y on in the plane y, z. Returns false if all are beyond the
/// reach.
bool ranks_along_y(const Extent& e, BandedDistance& work, std::size_t y, std::size_t z) {
  const BandedDistance::Ranks& ranks = work.ranks;
  const auto stride = static_cast<std::ptrdiff_t>(e.length);
  const std::uint8_t* first = work.proximity.data() + z * e.slice + (y + e.reach + kMoreOffsets) * e.length;
  const int at = static_cast<int>(y + e.reach), last = at + static_cast<int>(kRowsAtOnce) - 1;
  const auto far = hn::Set(kBytes, ranks.far);
  std::uint64_t any = 0;
  for (std::size_t x = 0, i = 0; x < e.used; x += kPad, ++i) {
    const RowsOfColumns& columns = work.columns[i];
    if (!columns.wanted) continue;
    const int nearest = nearest_bit(columns.bits.data() + 1, y + e.reach, kRowsAtOnce);
    const Offsets offsets{std::max(1, nearest),
                          std::min<int>(ranks.reach_of_proximity[columns.most],
                                        std::max(last - columns.span.first, columns.span.last - at))};
    Vectors<kRowsAtOnce> best{far, far, far, far};
    if (nearest == 0 || offsets.first <= offsets.last) {
      for (std::size_t r = 0; r < kRowsAtOnce; ++r)
        best[r] = look_up_64(ranks.of_proximity.data(), hn::LoadU(kBytes, first + x + r * e.length));
      least_of_neighbours<64>(
          best, first + x, stride, stride, offsets, ranks.of_proximity.data(), columns.most,
          [](Bytes a, Bytes b) HWY_ATTR { return hn::Max(a, b); },
          [](const std::uint8_t* table, Bytes index) HWY_ATTR { return look_up_64(table, index); });
    }
    const auto least = least_vector(best);
    put_columns(best, least, work.rank_columns.data() + kRowsAtOnce * (kPad + x), work.least_ranks[i]);
    const std::uint64_t bits = _cvtmask64_u64(_mm512_cmpneq_epu8_mask(least.raw, far.raw));
    work.in_band[1 + i] = bits;
    any |= bits;
  }
  return any != 0;
}

/// Ranks or orders of a brick's 32 columns in four rows, column after column.
using Columns = Vectors<kRowsAtOnce * workspace::kBrickEdge / kPad>;

/// Writes orders into a brick from `offset` on.
HWY_INLINE void put_orders(const Columns& orders, std::int8_t* brick, std::size_t offset) {
  // Transposes each tile's rows to the brick's layout: from 4 x + y to 4 y + x.
  const __m512i turned =
      _mm512_broadcast_i32x4(_mm_setr_epi8(0, 4, 8, 12, 1, 5, 9, 13, 2, 6, 10, 14, 3, 7, 11, 15));
  std::int8_t* to = brick + offset;
  for (const Bytes& columns : orders) {
    const __m512i tiles = _mm512_shuffle_epi8(columns.raw, turned);
    const auto put = [&](std::size_t tile, __m128i part)
                         HWY_ATTR { _mm_storeu_si128(reinterpret_cast<__m128i*>(to + 64 * tile), part); };
    put(0, _mm512_castsi512_si128(tiles));
    put(1, _mm512_extracti32x4_epi32(tiles, 1));
    put(2, _mm512_extracti32x4_epi32(tiles, 2));
    put(3, _mm512_extracti32x4_epi32(tiles, 3));
    to += 4 * 64;
  }
}

/// Returns the least rank, or less, of the columns within reach of a brick's columns, which begin at
/// `column`. Reads single words as they were written: loading them as a vector would stall on the pending
/// stores.
HWY_INLINE std::uint8_t least_around(const Extent& e, const BandedDistance& work, std::size_t column) {
  const std::size_t first = (column - e.reach) / kMinOf,
                    last = (column + workspace::kBrickEdge - 1 + e.reach) / kMinOf;
  const std::uint32_t* const words = work.least_ranks.data() + first / 4;
  const auto word = [words](std::size_t i) HWY_ATTR { return static_cast<int>(words[i]); };
  const __m128i all = _mm_setr_epi32(word(0), word(1), word(2), word(3));
  const auto asked = static_cast<__mmask16>(((2U << (last - first)) - 1) << (first % 4));
  const __m128i ranks = _mm_mask_mov_epi8(_mm_set1_epi8(-1), asked, all);
  return static_cast<std::uint8_t>(
      _mm_cvtsi128_si32(_mm_minpos_epu16(_mm_min_epu8(ranks, _mm_srli_epi16(ranks, 8)))));
}

/// Marks the boundary voxels of rows that begin at `first`.
HWY_INLINE void mark_boundary_columns(const SolidRows& solid, workspace::Index3 first, Columns& orders) {
  std::uint64_t low = 0, high = 0;
  const auto rows = solid.boundary<kRowsAtOnce>(first.x, first.y, first.z);
  for (std::size_t r = 0; r < kRowsAtOnce; ++r) {
    low |= _pdep_u64(rows[r], 0x1111111111111111ULL << r);
    high |= _pdep_u64(rows[r] >> 16, 0x1111111111111111ULL << r);
  }
  const __m512i boundary = _mm512_set1_epi8(workspace::kOrderBoundary);
  orders[0].raw = _mm512_mask_mov_epi8(orders[0].raw, low, boundary);
  orders[1].raw = _mm512_mask_mov_epi8(orders[1].raw, high, boundary);
}

/// Computes the orders of a brick's columns in the rows that begin at `first`, from the ranks in the plane y,
/// z. Returns false if all are beyond the reach.
HWY_INLINE bool orders_from_ranks(const Extent& e, const BandedDistance& work, std::size_t x,
                                  workspace::Index3 first, Columns& orders) {
  const BandedDistance::Ranks& ranks = work.ranks;
  const std::size_t column = e.halo + x;
  const int nearest = nearest_bit(work.in_band.data() + 1, column, workspace::kBrickEdge);
  if (nearest > static_cast<int>(e.reach)) return false;
  const std::uint8_t* const centre = work.rank_columns.data() + kRowsAtOnce * (kPad + column);
  bool solid = false;
  for (std::size_t i = 0; i < std::size(orders); ++i) {
    const auto own = hn::LoadU(kBytes, centre + i * kPad);
    solid |= _mm512_testn_epi8_mask(own.raw, own.raw) != 0;
    orders[i] = look_up_128(ranks.classes.data(), own);
  }
  const std::uint8_t least = least_around(e, work, column);
  least_of_neighbours<128>(
      orders, centre, kPad, kRowsAtOnce, {std::max(1, nearest), ranks.reach_of_rank[least]},
      ranks.classes.data(), least, [](Bytes a, Bytes b) HWY_ATTR { return hn::Min(a, b); },
      [](const std::uint8_t* table, Bytes index) HWY_ATTR { return look_up_128(table, index); });
  for (Bytes& columns : orders) columns = look_up_64(ranks.orders.data(), columns);
  if (solid) mark_boundary_columns(work.solid(), first, orders);
  return true;
}

/// Writes the orders of a slice's rows from y on into the bricks. `in_band`: whether anything of the slice is
/// within reach.
void rows_of_slice(const Extent& e, const BrickBlock& block, std::size_t y, std::size_t z, bool in_band,
                   BandedDistance& work) {
  const bool any = in_band && ranks_along_y(e, work, y, z);
  const std::size_t offset = workspace::brick_offset(0, static_cast<std::uint32_t>(y % workspace::kBrickEdge),
                                                     static_cast<std::uint32_t>(z % workspace::kBrickEdge));
  const auto beyond = hn::Set(kBytes, static_cast<std::uint8_t>(work.steps().order.back()));
  std::int8_t* const* const bricks = bricks_at(block, y, z);
  workspace::Index3 first = voxel_of(block, y, z);
  for (std::size_t i = 0; i < static_cast<std::size_t>(block.nx); ++i, first.x += workspace::kBrickEdge) {
    if (bricks[i] == nullptr) continue;
    Columns orders;
    if (!any || !orders_from_ranks(e, work, i * workspace::kBrickEdge, first, orders)) {
      for (Bytes& columns : orders) columns = beyond;
    }
    put_orders(orders, bricks[i], offset);
  }
}

/// Number of rows of summaries, rounded up to whole vectors.
std::size_t summary_rows(const Extent& e) { return (e.rows + 15) / 16 * 16; }

/// Summaries what the rows of distances along z have in reach, while they are computed.
class RowSummaries {
 public:
  static constexpr bool kWanted = true;

  RowSummaries(const Extent& e, BandedDistance& work)
      : vectors_(e.length / kPad), rows_(summary_rows(e)), ny_(e.ny), work_(work) {
    work.row_summaries.resize(e.nz / workspace::kBrickEdge * vectors_ * rows_);
  }

  /// Keeps the summaries of the first `known` rows, which were the rows after the previous block's.
  void keep(std::size_t known) {
    for (std::size_t first = 0; first < work_.row_summaries.size(); first += rows_) {
      const auto rows = work_.row_summaries.begin() + static_cast<std::ptrdiff_t>(first);
      const auto kept = known == 0 ? rows : std::copy_n(rows + static_cast<std::ptrdiff_t>(ny_), known, rows);
      std::fill(kept, rows + static_cast<std::ptrdiff_t>(rows_), RowSummary{});
    }
  }
  void add(std::size_t vector, std::size_t y, std::size_t layer, std::uint32_t in_reach,
           const std::uint64_t* words) {
    RowSummary add_summary{in_reach, 0};
    for (unsigned slice = 0; slice < workspace::kBrickEdge; slice += 8) {
      const __m512i eight = _mm512_loadu_si512(words + slice);
      add_summary.solid |= std::uint32_t{_mm512_test_epi64_mask(eight, eight)} << slice;
    }
    work_.row_summaries[(layer * vectors_ + vector) * rows_ + y] = add_summary;
  }

 private:
  std::size_t vectors_, rows_, ny_;
  BandedDistance& work_;
};

/// Returns the greatest proximity of a vector of columns in a range of rows of a slice.
std::uint8_t greatest_proximity(const Extent& e, const BandedDistance& work, std::size_t x, SolidSpan rows,
                                std::size_t z) {
  const std::uint8_t* from = work.proximity.data() + z * e.slice + kMoreOffsets * e.length + x;
  auto most = hn::Zero(kBytes);
  for (int y = rows.first; y <= rows.last; ++y)
    most = hn::Max(most, hn::Load(kBytes, from + static_cast<std::size_t>(y) * e.length));
  return static_cast<std::uint8_t>(255 - least_of(hn::Xor(most, hn::Set(kBytes, std::uint8_t{255}))));
}

/// Summarises the columns of a slice. Returns false if they are all beyond the reach.
bool look_at_columns(const Extent& e, BandedDistance& work, std::size_t z) {
  bool any = false;
  const std::size_t rows = summary_rows(e);
  const __m512i slice =
      _mm512_set1_epi64(static_cast<std::int64_t>(0x0000000100000001ULL << (z % workspace::kBrickEdge)));
  for (std::size_t x = 0, i = 0; x < e.used; x += kPad, ++i) {
    RowsOfColumns& columns = work.columns[i];
    if (!columns.wanted) continue;
    const RowSummary* summaries =
        work.row_summaries.data() + (z / workspace::kBrickEdge * (e.length / kPad) + i) * rows;
    columns.bits = {};
    columns.span = {};
    std::uint64_t solid = 0;
    for (std::size_t y = 0; y < rows; y += 16) {
      // Two bits for each row: in reach, solid.
      const std::uint32_t eight[2] = {_mm512_test_epi32_mask(_mm512_loadu_si512(summaries + y), slice),
                                      _mm512_test_epi32_mask(_mm512_loadu_si512(summaries + y + 8), slice)};
      const std::uint32_t both = eight[0] | eight[1] << 16;
      columns.bits[1 + y / 64] |= std::uint64_t{_pext_u32(both, 0x55555555U)} << (y % 64);
      solid |= both & 0xaaaaaaaaU;
    }
    for (std::size_t word = 1; word + 1 < columns.bits.size(); ++word) {
      const std::uint64_t bits = columns.bits[word];
      if (bits == 0) continue;
      const int first = static_cast<int>(word - 1) * 64;
      columns.span.add({first + std::countr_zero(bits), first + 63 - std::countl_zero(bits)});
    }
    if (columns.span.empty()) continue;
    columns.most =
        solid != 0 ? static_cast<std::uint8_t>(e.reach + 1) : greatest_proximity(e, work, x, columns.span, z);
    any = true;
  }
  return any;
}

}  // namespace phantom::layers::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif  // HWY_AVX3_DL

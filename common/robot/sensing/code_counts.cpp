// Counts voxel codes; compiled once for each instruction set, like sensing_kernel.cpp.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "common/robot/sensing/code_counts.cpp"
#include <hwy/foreach_target.h>  // must come before highway.h
#include <hwy/highway.h>

#include "common/robot/sensing/sensing_kernel.hpp"

HWY_BEFORE_NAMESPACE();
namespace phantom::robot::kernel::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

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
  for (std::size_t k = 0; k < step; ++k)
    figures.greatest = lane[k] > figures.greatest ? lane[k] : figures.greatest;
  for (; i < n; ++i) {
    figures.greatest = codes[i] > figures.greatest ? codes[i] : figures.greatest;
    figures.active += codes[i] != 0 ? 1U : 0U;
  }
  return figures;
}

/// Codes that are counted in one pass, each in its own vector of byte counts.
constexpr std::size_t kMaxTogether = 8;

/// Sets counts[k], for k < kCodes, to the number of voxels that hold first_code + k.
template <std::size_t kCodes>
void count_together(const std::uint8_t* const* tiles, const std::uint64_t* masks, std::size_t n,
                    std::size_t first_code, std::uint32_t* counts) {
  const hn::CappedTag<std::uint8_t, 64> d;
  const hn::Repartition<std::uint64_t, decltype(d)> wide;
  using V = hn::Vec<decltype(d)>;
  const std::size_t step = hn::Lanes(d);
  const std::size_t together = 255 * step / 64;  // tiles after which a byte count may be full
  V code[kCodes];
  for (std::size_t k = 0; k < kCodes; ++k) {
    code[k] = hn::Set(d, static_cast<std::uint8_t>(first_code + k));
    counts[k] = 0;
  }
  const V one = hn::Set(d, 1);
  for (std::size_t first = 0; first < n; first += together) {
    const std::size_t end = first + together < n ? first + together : n;
    V count[kCodes];
    for (std::size_t k = 0; k < kCodes; ++k) count[k] = hn::Zero(d);
    for (std::size_t t = first; t < end; ++t) {
      for (std::size_t i = 0; i < 64; i += step) {
        const auto bits = hn::LoadMaskBits(d, reinterpret_cast<const std::uint8_t*>(masks + t) + i / 8);
        const V voxels = hn::IfThenElseZero(bits, hn::LoadU(d, tiles[t] + i));
        for (std::size_t k = 0; k < kCodes; ++k)
          count[k] = hn::IfThenElse(hn::Eq(voxels, code[k]), hn::Add(count[k], one), count[k]);
      }
    }
    // Four counts of 16 bits each fit in a word of 64 bits, so one addition adds all four.
    for (std::size_t k = 0; k < kCodes; k += 4) {
      auto four = hn::SumsOf8(count[k]);
      if (k + 1 < kCodes) four = hn::Or(four, hn::ShiftLeft<16>(hn::SumsOf8(count[k + 1])));
      if (k + 2 < kCodes) four = hn::Or(four, hn::ShiftLeft<32>(hn::SumsOf8(count[k + 2])));
      if (k + 3 < kCodes) four = hn::Or(four, hn::ShiftLeft<48>(hn::SumsOf8(count[k + 3])));
      const std::uint64_t sums = hn::GetLane(hn::SumOfLanes(wide, four));
      for (std::size_t j = 0; j < 4 && k + j < kCodes; ++j)
        counts[k + j] += static_cast<std::uint32_t>(sums >> 16 * j & 0xFFFF);
    }
  }
}

template <std::size_t kCodes = kMaxTogether>
void count_some(std::size_t codes, const std::uint8_t* const* tiles, const std::uint64_t* masks,
                std::size_t n, std::size_t first_code, std::uint32_t* counts) {
  if constexpr (kCodes > 1) {
    if (codes < kCodes) return count_some<kCodes - 1>(codes, tiles, masks, n, first_code, counts);
  }
  count_together<kCodes>(tiles, masks, n, first_code, counts);
}

void CountCodes(const std::uint8_t* const* tiles, const std::uint64_t* masks, std::size_t n,
                std::size_t codes, std::uint32_t* counts) {
  for (std::size_t first = 1; first < codes; first += kMaxTogether)
    count_some(codes - first, tiles, masks, n, first, counts + first);
}

}  // namespace phantom::robot::kernel::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace phantom::robot::kernel {

HWY_EXPORT(FiguresOf);
HWY_EXPORT(CountCodes);

CodeFigures figures_of(const std::uint8_t* codes, std::size_t n) noexcept {
  return HWY_DYNAMIC_DISPATCH(FiguresOf)(codes, n);
}

void count_codes(const std::uint8_t* const* tiles, const std::uint64_t* masks, std::size_t n,
                 std::size_t codes, std::uint32_t* counts) noexcept {
  HWY_DYNAMIC_DISPATCH(CountCodes)(tiles, masks, n, codes, counts);
}

}  // namespace phantom::robot::kernel
#endif  // HWY_ONCE

#include "common/voxel/voxel_box.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "common/voxel/bit_count.cpp"
#include <hwy/foreach_target.h>  // once per instruction set
// (keep this order)
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace phantom::voxel::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

std::size_t CountBits(const std::uint64_t* words, std::size_t count) {
  const hn::ScalableTag<std::uint64_t> d;
  auto sums = hn::Zero(d);
  std::size_t i = 0;
  for (; i + hn::Lanes(d) <= count; i += hn::Lanes(d))
    sums = hn::Add(sums, hn::PopulationCount(hn::LoadU(d, words + i)));
  auto all = static_cast<std::size_t>(hn::GetLane(hn::SumOfLanes(d, sums)));
  for (; i < count; ++i) all += static_cast<std::size_t>(std::popcount(words[i]));
  return all;
}

}  // namespace phantom::voxel::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace phantom::voxel {

HWY_EXPORT(CountBits);

std::size_t count_bits(const std::uint64_t* words, std::size_t count) {
  return HWY_DYNAMIC_DISPATCH(CountBits)(words, count);
}

}  // namespace phantom::voxel
#endif

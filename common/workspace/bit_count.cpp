#include "common/workspace/voxel_box.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "common/workspace/bit_count.cpp"
#include <hwy/foreach_target.h>  // once per instruction set
// (keep this order)
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace phantom::workspace::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

BitCounts CountBits(const std::uint64_t* a, const std::uint64_t* b, std::size_t count) {
  const hn::ScalableTag<std::uint64_t> d;
  auto of_a = hn::Zero(d), only_b = hn::Zero(d);
  std::size_t i = 0;
  for (; i + hn::Lanes(d) <= count; i += hn::Lanes(d)) {
    const auto here = hn::LoadU(d, a + i);
    of_a = hn::Add(of_a, hn::PopulationCount(here));
    only_b = hn::Add(only_b, hn::PopulationCount(hn::AndNot(here, hn::LoadU(d, b + i))));
  }
  BitCounts all{static_cast<std::size_t>(hn::GetLane(hn::SumOfLanes(d, of_a))),
                static_cast<std::size_t>(hn::GetLane(hn::SumOfLanes(d, only_b)))};
  for (; i < count; ++i) {
    all.a += static_cast<std::size_t>(std::popcount(a[i]));
    all.only_b += static_cast<std::size_t>(std::popcount(b[i] & ~a[i]));
  }
  return all;
}

}  // namespace phantom::workspace::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace phantom::workspace {

HWY_EXPORT(CountBits);

BitCounts count_bits(const std::uint64_t* a, const std::uint64_t* b, std::size_t count) {
  return HWY_DYNAMIC_DISPATCH(CountBits)(a, b, count);
}

}  // namespace phantom::workspace
#endif

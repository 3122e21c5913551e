#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tests/bench/bare_gather.cpp"
#include "tests/bench/bare_gather.hpp"

#include <hwy/foreach_target.h>  // must come before highway.h
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace phantom::bench {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using Ints = hn::CappedTag<std::int32_t, 16>;
using Words = hn::Rebind<std::uint32_t, Ints>;

HWY_INLINE hn::Vec<Words> bytes_at(const std::uint8_t* codes, hn::Vec<Ints> word,
                                   const std::uint32_t* shift) {
  const Words dw;
  const auto four = hn::GatherIndex(dw, reinterpret_cast<const std::uint32_t*>(codes), word);
  return hn::And(hn::Shr(four, hn::LoadU(dw, shift)), hn::Set(dw, 0xFF));
}

std::uint64_t Gather(const std::uint32_t* directory, const std::uint8_t* codes, const std::int32_t* brick,
                     const std::int32_t* word, const std::uint32_t* shift, std::size_t n) {
  const Ints di;
  const Words dw;
  auto sum = hn::Zero(dw);
  for (std::size_t i = 0; i < n; i += hn::Lanes(di)) {
    const auto slot =
        hn::GatherIndex(di, reinterpret_cast<const std::int32_t*>(directory), hn::LoadU(di, brick + i));
    sum = hn::Add(sum, bytes_at(codes, hn::Add(hn::ShiftLeft<13>(slot), hn::LoadU(di, word + i)), shift + i));
  }
  return hn::GetLane(hn::SumOfLanes(dw, sum));
}

std::uint64_t Flat(const std::uint8_t* codes, const std::int32_t* word, const std::uint32_t* shift,
                   std::size_t n) {
  const Ints di;
  const Words dw;
  auto sum = hn::Zero(dw);
  for (std::size_t i = 0; i < n; i += hn::Lanes(di))
    sum = hn::Add(sum, bytes_at(codes, hn::LoadU(di, word + i), shift + i));
  return hn::GetLane(hn::SumOfLanes(dw, sum));
}

}  // namespace HWY_NAMESPACE
}  // namespace phantom::bench
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace phantom::bench {

HWY_EXPORT(Gather);
HWY_EXPORT(Flat);

std::uint64_t bare_gather(const std::uint32_t* directory, const std::uint8_t* codes,
                          const std::int32_t* brick, const std::int32_t* word, const std::uint32_t* shift,
                          std::size_t n) {
  return HWY_DYNAMIC_DISPATCH(Gather)(directory, codes, brick, word, shift, n);
}

std::uint64_t bare_gather_flat(const std::uint8_t* codes, const std::int32_t* word,
                               const std::uint32_t* shift, std::size_t n) {
  return HWY_DYNAMIC_DISPATCH(Flat)(codes, word, shift, n);
}

}  // namespace phantom::bench
#endif  // HWY_ONCE

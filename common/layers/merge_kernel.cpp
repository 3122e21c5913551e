#include "common/layers/merge_kernel.hpp"

// Compiled once for each instruction set; the best one is chosen at run time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "common/layers/merge_kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "common/layers/byte_lookup-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace phantom::layers::detail::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

HWY_INLINE Bytes load(const std::int8_t* from) {
  return hn::LoadU(kBytes, reinterpret_cast<const std::uint8_t*>(from));
}

constexpr hn::ScalableTag<std::uint16_t> kShorts;
constexpr hn::Rebind<std::uint8_t, decltype(kShorts)> kHalfBytes;

/// Calls put(index, mask of the object ids from there on) for a vector of bytes; a byte is chosen if it is
/// not 0.
template <class Put>
HWY_INLINE void for_ids(Bytes chosen, const Put& put) {
  HWY_ALIGN std::uint8_t bytes[HWY_MAX_BYTES];
  hn::Store(chosen, kBytes, bytes);
  for (std::size_t i = 0; i < hn::Lanes(kBytes); i += hn::Lanes(kShorts))
    put(i, hn::Ne(hn::PromoteTo(kShorts, hn::Load(kHalfBytes, bytes + i)), hn::Zero(kShorts)));
}

void look_up(const workspace::CodeTable& table, const std::int8_t* orders, std::uint16_t id,
             std::uint8_t* codes, std::uint16_t* objects) {
  const ByteLookup lookup(table.data());
  const auto ids = hn::Set(kShorts, id);
  for (std::size_t i = 0; i < workspace::kBrickVoxels; i += hn::Lanes(kBytes)) {
    const auto code = lookup(load(orders + i));
    hn::StoreU(code, kBytes, codes + i);
    if (objects != nullptr)
      for_ids(code, [&](std::size_t lane, auto there) HWY_ATTR {
        hn::StoreU(hn::IfThenElseZero(there, ids), kShorts, objects + i + lane);
      });
  }
}

void take(const workspace::CodeTable& table, const std::int8_t* orders, std::uint16_t id,
          const std::uint8_t* settled, std::uint8_t* codes, std::int8_t* winners, std::uint16_t* objects) {
  const ByteLookup lookup(table.data());
  const auto ids = hn::Set(kShorts, id);
  for (std::size_t i = 0; i < workspace::kBrickVoxels; i += hn::Lanes(kBytes)) {
    const auto order = load(orders + i);
    const auto there = hn::LoadU(kBytes, codes + i);
    auto code = lookup(order);
    if (settled != nullptr)
      code = hn::IfThenElseZero(hn::Eq(hn::LoadU(kBytes, settled + i), hn::Zero(kBytes)), code);
    const auto higher = hn::Max(code, there);
    const auto stays = hn::Eq(higher, there);
    if (hn::AllTrue(kBytes, stays)) continue;
    auto* winner = reinterpret_cast<std::uint8_t*>(winners + i);
    hn::StoreU(higher, kBytes, codes + i);
    hn::StoreU(hn::IfThenElse(stays, hn::LoadU(kBytes, winner), order), kBytes, winner);
    for_ids(hn::IfThenZeroElse(stays, hn::Set(kBytes, std::uint8_t{255})),
            [&](std::size_t lane, auto taken) HWY_ATTR {
              std::uint16_t* to = objects + i + lane;
              hn::StoreU(hn::IfThenElse(taken, ids, hn::LoadU(kShorts, to)), kShorts, to);
            });
  }
}

}  // namespace phantom::layers::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace phantom::layers::detail {

HWY_EXPORT(look_up);
HWY_EXPORT(take);

void codes_of(const workspace::CodeTable& table, const std::int8_t* orders, std::uint16_t id,
              std::uint8_t* codes, std::uint16_t* objects) {
  HWY_DYNAMIC_DISPATCH(look_up)(table, orders, id, codes, objects);
}

void claim(const workspace::CodeTable& table, const std::int8_t* orders, std::uint16_t id,
           const std::uint8_t* settled, std::uint8_t* codes, std::int8_t* winners, std::uint16_t* objects) {
  HWY_DYNAMIC_DISPATCH(take)(table, orders, id, settled, codes, winners, objects);
}

}  // namespace phantom::layers::detail
#endif  // HWY_ONCE

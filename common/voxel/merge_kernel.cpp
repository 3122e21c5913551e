#include "common/voxel/merge_kernel.hpp"

#include <algorithm>
#include <array>

// Compiled once per instruction set; the best one that the machine has is picked when it runs.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "common/voxel/merge_kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace phantom::voxel::detail::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

constexpr hn::ScalableTag<std::uint8_t> kBytes;
using Bytes = hn::Vec<decltype(kBytes)>;

/// A code table as rows of 16 that one instruction looks up; rows without a code are left out.
class Lookup {
 public:
  explicit Lookup(const CodeTable& table) : table_(table) {
    for (std::size_t row = 0; row < 256; row += 16) {
      if (std::any_of(table.begin() + static_cast<std::ptrdiff_t>(row),
                      table.begin() + static_cast<std::ptrdiff_t>(row) + 16,
                      [](std::uint8_t code) { return code != 0; }))
        rows_[count_++] = static_cast<std::uint8_t>(row);
    }
  }
  HWY_INLINE Bytes operator()(const std::int8_t* orders) const {
    const auto order = hn::LoadU(kBytes, reinterpret_cast<const std::uint8_t*>(orders));
#if HWY_TARGET == HWY_SCALAR
    return hn::Set(kBytes, table_[hn::GetLane(order)]);
#else
    const auto column = hn::And(order, hn::Set(kBytes, std::uint8_t{15})), row = hn::Sub(order, column);
    auto code = hn::Zero(kBytes);
    for (std::size_t i = 0; i < count_; ++i) {
      const auto found = hn::TableLookupBytes(hn::LoadDup128(kBytes, table_.data() + rows_[i]), column);
      code = hn::IfThenElse(hn::Eq(row, hn::Set(kBytes, rows_[i])), found, code);
    }
    return code;
#endif
  }

 private:
  const CodeTable& table_;
  std::array<std::uint8_t, 16> rows_{};
  std::size_t count_ = 0;
};

constexpr hn::ScalableTag<std::uint16_t> kShorts;
constexpr hn::Rebind<std::uint8_t, decltype(kShorts)> kHalfBytes;

/// Calls put(place, mask of the object ids from there on) for a vector of bytes that are chosen if not 0.
template <class Put>
HWY_INLINE void for_ids(Bytes chosen, const Put& put) {
  HWY_ALIGN std::uint8_t bytes[HWY_MAX_BYTES];
  hn::Store(chosen, kBytes, bytes);
  for (std::size_t i = 0; i < hn::Lanes(kBytes); i += hn::Lanes(kShorts))
    put(i, hn::Ne(hn::PromoteTo(kShorts, hn::Load(kHalfBytes, bytes + i)), hn::Zero(kShorts)));
}

void look_up(const CodeTable& table, const std::int8_t* orders, std::uint16_t id, std::uint8_t* codes,
             std::uint16_t* objects) {
  const Lookup lookup(table);
  const auto ids = hn::Set(kShorts, id);
  for (std::size_t i = 0; i < kBrickVoxels; i += hn::Lanes(kBytes)) {
    const auto code = lookup(orders + i);
    hn::StoreU(code, kBytes, codes + i);
    if (objects != nullptr)
      for_ids(code, [&](std::size_t lane, auto there) HWY_ATTR {
        hn::StoreU(hn::IfThenElseZero(there, ids), kShorts, objects + i + lane);
      });
  }
}

void take(const CodeTable& table, const std::int8_t* orders, std::uint16_t id, const std::uint8_t* settled,
          std::uint8_t* codes, std::int8_t* winners, std::uint16_t* objects) {
  const Lookup lookup(table);
  const auto ids = hn::Set(kShorts, id);
  for (std::size_t i = 0; i < kBrickVoxels; i += hn::Lanes(kBytes)) {
    const auto order = hn::LoadU(kBytes, reinterpret_cast<const std::uint8_t*>(orders + i));
    const auto there = hn::LoadU(kBytes, codes + i);
    auto code = lookup(orders + i);
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

}  // namespace phantom::voxel::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace phantom::voxel::detail {

HWY_EXPORT(look_up);
HWY_EXPORT(take);

void codes_of(const CodeTable& table, const std::int8_t* orders, std::uint16_t id, std::uint8_t* codes,
              std::uint16_t* objects) {
  HWY_DYNAMIC_DISPATCH(look_up)(table, orders, id, codes, objects);
}

void claim(const CodeTable& table, const std::int8_t* orders, std::uint16_t id, const std::uint8_t* settled,
           std::uint8_t* codes, std::int8_t* winners, std::uint16_t* objects) {
  HWY_DYNAMIC_DISPATCH(take)(table, orders, id, settled, codes, winners, objects);
}

}  // namespace phantom::voxel::detail
#endif  // HWY_ONCE

#include "common/layers/merge_kernel.hpp"

#include <algorithm>
#include <array>

// Compiled once for each instruction set; the best one is chosen at run time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "common/layers/merge_kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace phantom::layers::detail::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

constexpr hn::ScalableTag<std::uint8_t> kBytes;
using Bytes = hn::Vec<decltype(kBytes)>;

/// A table in rows of 16, each looked up by one instruction. Rows that hold only 0 are left out.
class ByteLookup {
 public:
  /// Keeps a pointer to the 256 bytes.
  explicit ByteLookup(const std::uint8_t* table) : table_(table) {
    for (std::size_t row = 0; row < 256; row += 16) {
      if (std::any_of(table + row, table + row + 16, [](std::uint8_t byte) { return byte != 0; }))
        rows_[count_++] = static_cast<std::uint8_t>(row);
    }
  }
  HWY_INLINE Bytes operator()(Bytes index) const {
    const auto column = hn::And(index, hn::Set(kBytes, std::uint8_t{15})), row = hn::Sub(index, column);
    auto found = hn::Zero(kBytes);
    for (std::size_t i = 0; i < count_; ++i) {
      const auto here = hn::TableLookupBytes(hn::LoadDup128(kBytes, table_ + rows_[i]), column);
      found = hn::IfThenElse(hn::Eq(row, hn::Set(kBytes, rows_[i])), here, found);
    }
    return found;
  }

 private:
  const std::uint8_t* table_;
  std::array<std::uint8_t, 16> rows_{};
  std::size_t count_ = 0;
};

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
          const std::uint8_t* locked, std::uint8_t* codes, std::int8_t* winners, std::uint16_t* objects) {
  const ByteLookup lookup(table.data());
  const auto ids = hn::Set(kShorts, id);
  for (std::size_t i = 0; i < workspace::kBrickVoxels; i += hn::Lanes(kBytes)) {
    const auto order = load(orders + i);
    const auto there = hn::LoadU(kBytes, codes + i);
    auto code = lookup(order);
    if (locked != nullptr)
      code = hn::IfThenElseZero(hn::Eq(hn::LoadU(kBytes, locked + i), hn::Zero(kBytes)), code);
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

void merge_candidate(const workspace::CodeTable& table, const std::int8_t* orders, std::uint16_t id,
                     const std::uint8_t* locked, std::uint8_t* codes, std::int8_t* winners,
                     std::uint16_t* objects) {
  HWY_DYNAMIC_DISPATCH(take)(table, orders, id, locked, codes, winners, objects);
}

}  // namespace phantom::layers::detail
#endif  // HWY_ONCE

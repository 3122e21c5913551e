#include "common/voxel/orders_by_code.hpp"

#include "common/voxel/brick_content.hpp"

// Compiled once per instruction set; the best one that the machine has is picked when it runs.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "common/voxel/orders_by_code.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "common/voxel/byte_lookup-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace phantom::voxel::detail::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

constexpr hn::CappedTag<std::uint8_t, 64> kWord;  // bytes of voxels that a word of bits tells of

ByteLookup lookup_of(const std::array<std::int8_t, 256>& table) {
  return ByteLookup(reinterpret_cast<const std::uint8_t*>(table.data()));
}

/// Writes a bit for each voxel: whether its order is the second of its code; false if one's is neither.
/// `any`: whether a bit is set.
bool FindSecond(const OrderTables& tables, const std::uint8_t* codes, const std::uint8_t* orders,
                std::uint64_t* second, bool& any) {
  const ByteLookup first_of = lookup_of(tables.first), second_of = lookup_of(tables.second);
  any = false;
  for (std::size_t i = 0; i < kBrickVoxels; i += 64) {
    std::uint64_t bits = 0;
    for (std::size_t part = 0; part < 64; part += hn::Lanes(kWord)) {
      const auto code = hn::LoadU(kWord, codes + i + part), order = hn::LoadU(kWord, orders + i + part);
      const auto other = hn::Ne(order, first_of(code));
      if (hn::AllFalse(kWord, other)) continue;
      if (!hn::AllFalse(kWord, hn::And(other, hn::Ne(order, second_of(code))))) return false;
      std::uint64_t of_part = 0;
      hn::StoreMaskBits(kWord, other, reinterpret_cast<std::uint8_t*>(&of_part));
      bits |= of_part << part;
    }
    second[i / 64] = bits;
    any |= bits != 0;
  }
  return true;
}

void ReadOrders(const OrderTables& tables, const std::uint64_t* second, const std::uint8_t* codes,
                std::uint8_t* orders) {
  const ByteLookup first_of = lookup_of(tables.first), second_of = lookup_of(tables.second);
  for (std::size_t i = 0; i < kBrickVoxels; i += 64) {
    for (std::size_t part = 0; part < 64; part += hn::Lanes(kWord)) {
      const auto code = hn::LoadU(kWord, codes + i + part);
      auto order = first_of(code);
      const std::uint64_t bits = second == nullptr ? 0 : second[i / 64] >> part;
      if (bits != 0) {
        const auto mask = hn::LoadMaskBits(kWord, reinterpret_cast<const std::uint8_t*>(&bits));
        order = hn::IfThenElse(mask, second_of(code), order);
      }
      hn::StoreU(order, kWord, orders + i + part);
    }
  }
}

}  // namespace phantom::voxel::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace phantom::voxel {
namespace detail {

HWY_EXPORT(FindSecond);
HWY_EXPORT(ReadOrders);

}  // namespace detail

void orders_by_code(const OrderTables& tables, const std::uint64_t* second, const std::uint8_t* mu_codes,
                    std::int8_t* orders) {
  using namespace detail;
  HWY_DYNAMIC_DISPATCH(ReadOrders)(tables, second, mu_codes, reinterpret_cast<std::uint8_t*>(orders));
}

OrdersByCode OrderPacker::pack(const BrickData& brick) {
  using namespace detail;
  std::array<std::uint64_t, kBrickVoxels / 64> second;
  bool any = false;
  const auto found = [&] {
    return HWY_DYNAMIC_DISPATCH(FindSecond)(*tables_, brick.mu_code.data(),
                                            reinterpret_cast<const std::uint8_t*>(brick.order.data()),
                                            second.data(), any);
  };
  if (!found()) {
    if (!tables_for(brick.mu_code, brick.order)) return {};
    found();
  }
  OrdersByCode orders{tables_, {}};
  if (any) orders.second.assign(second.begin(), second.end());
  return orders;
}

std::shared_ptr<const OrderTables> OrderPacker::tables_for(std::span<const std::uint8_t> mu_codes,
                                                           std::span<const std::int8_t> orders) {
  if (!learn(mu_codes, orders)) {
    known_ = {};
    if (!learn(mu_codes, orders)) return nullptr;
  }
  return tables_;
}

/// Adds what is new to the tables; false if there are too many.
bool OrderPacker::learn(std::span<const std::uint8_t> mu_codes, std::span<const std::int8_t> orders) {
  OrderTables tables = *tables_;
  std::array<std::uint8_t, 256> known = known_;
  for (std::size_t i = 0; i < mu_codes.size(); ++i) {
    const std::uint8_t code = mu_codes[i];
    const std::int8_t order = orders[i];
    if (known[code] >= 1 && tables.first[code] == order) continue;
    if (known[code] == 2 && tables.second[code] == order) continue;
    if (known[code] == 2) return false;
    (known[code] == 0 ? tables.first : tables.second)[code] = order;
    ++known[code];
  }
  if (known == known_) return true;
  known_ = known;
  tables_ = std::make_shared<OrderTables>(tables);
  return true;
}

}  // namespace phantom::voxel
#endif  // HWY_ONCE

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace phantom::voxel {

struct BrickData;

/// The orders that voxels of each code have: one, or two of the same μ (boundary and interior, guard and
/// first layer).
struct OrderTables {
  std::array<std::int8_t, 256> first{}, second{};
};

/// Orders of a brick's voxels, told by their codes: in a ninth of the memory at most.
struct OrdersByCode {
  std::shared_ptr<const OrderTables> tables;  ///< null: they are told otherwise
  std::vector<std::uint64_t> second;  ///< a bit for each voxel: its order is the second of its code; none: no
                                      ///< voxel's is

  std::size_t bytes() const { return second.size() * sizeof(second[0]); }
};

/// One voxel's order; `second` may be null. Real-time safe: yes.
inline std::int8_t order_by_code(const OrderTables& tables, const std::uint64_t* second, std::size_t voxel,
                                 std::uint8_t mu_code) {
  const bool is_second = second != nullptr && (second[voxel / 64] >> (voxel % 64) & 1) != 0;
  return (is_second ? tables.second : tables.first)[mu_code];
}
/// The same of all kBrickVoxels.
void orders_by_code(const OrderTables& tables, const std::uint64_t* second, const std::uint8_t* mu_codes,
                    std::int8_t* orders);

/// Finds how orders can be told by codes, for one brick after the other: most are alike. Not for several
/// threads at once.
class OrderPacker {
 public:
  /// Without tables if voxels of one code have more than two orders. Throws std::bad_alloc.
  OrdersByCode pack(const BrickData& brick);
  /// The tables for voxels with these codes and orders (of each as many as of the other); null if a code has
  /// more than two. Throws std::bad_alloc.
  std::shared_ptr<const OrderTables> tables_for(std::span<const std::uint8_t> mu_codes,
                                                std::span<const std::int8_t> orders);

 private:
  bool learn(std::span<const std::uint8_t> mu_codes, std::span<const std::int8_t> orders);

  std::array<std::uint8_t, 256> known_{};  // orders known of each code
  std::shared_ptr<const OrderTables> tables_ = std::make_shared<OrderTables>();
};

}  // namespace phantom::voxel

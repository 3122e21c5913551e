// Private to this library: looks bytes up in a table of 256. Compiled once for each instruction set.

#if defined(PHANTOM_LAYERS_BYTE_LOOKUP_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef PHANTOM_LAYERS_BYTE_LOOKUP_INL
#undef PHANTOM_LAYERS_BYTE_LOOKUP_INL
#else
#define PHANTOM_LAYERS_BYTE_LOOKUP_INL
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

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
#if HWY_TARGET == HWY_SCALAR
    return hn::Set(kBytes, table_[hn::GetLane(index)]);
#else
    const auto column = hn::And(index, hn::Set(kBytes, std::uint8_t{15})), row = hn::Sub(index, column);
    auto found = hn::Zero(kBytes);
    for (std::size_t i = 0; i < count_; ++i) {
      const auto here = hn::TableLookupBytes(hn::LoadDup128(kBytes, table_ + rows_[i]), column);
      found = hn::IfThenElse(hn::Eq(row, hn::Set(kBytes, rows_[i])), here, found);
    }
    return found;
#endif
  }

 private:
  const std::uint8_t* table_;
  std::array<std::uint8_t, 16> rows_{};
  std::size_t count_ = 0;
};

}  // namespace phantom::layers::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif

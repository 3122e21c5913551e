#include "common/voxel/banded_distance.hpp"

#include <algorithm>
#include <cstddef>
#include <cstring>

// One source for every x86-64: the compiler makes a version per instruction set and picks at load time.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)
#define PHANTOM_SIMD_CLONES __attribute__((target_clones("arch=skylake-avx512", "avx2", "default")))
#else
#define PHANTOM_SIMD_CLONES
#endif

namespace phantom::voxel::detail {
namespace {

constexpr std::size_t kLanes = 32;  // u16 side by side: a cache line

PHANTOM_SIMD_CLONES
void step_away(const std::uint8_t* before, std::uint8_t* here, std::size_t count, std::uint8_t most) {
  for (std::size_t i = 0; i < count; ++i) {
    const auto next = static_cast<std::uint8_t>(before[i] < most ? before[i] + 1 : most);
    here[i] = std::min(here[i], next);
  }
}

PHANTOM_SIMD_CLONES
bool any_below(const std::uint8_t* row, std::size_t count, std::uint8_t limit) {
  unsigned found = 0;
  for (std::size_t i = 0; i < count; ++i) found |= row[i] < limit ? 1U : 0U;
  return found != 0;
}

PHANTOM_SIMD_CLONES
void squares(const std::uint8_t* distance, std::uint16_t* square, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) square[i] = static_cast<std::uint16_t>(distance[i] * distance[i]);
}

/// best[i] = min over |k| ≤ reach of centre[i + k·stride] + k², for kLanes neighbours at once. Ends as soon
/// as no farther neighbour can be nearer. Sums never exceed 16 bits where they could win: both terms are
/// below (reach + 1)² ≤ 65025, and saturation keeps the others from wrapping.
PHANTOM_SIMD_CLONES
void nearest_in_line(const std::uint16_t* centre, std::ptrdiff_t stride, int reach, std::uint16_t* best_out) {
  std::uint16_t best[kLanes];
  std::memcpy(best, centre, sizeof best);
  for (int k = 1; k <= reach; ++k) {
    const auto square = static_cast<std::uint16_t>(k * k);
    if ((k & 3) == 1) {
      std::uint16_t greatest = 0;
      for (std::size_t i = 0; i < kLanes; ++i) greatest = std::max(greatest, best[i]);
      if (greatest <= square) break;
    }
    const std::uint16_t* before = centre - k * stride;
    const std::uint16_t* behind = centre + k * stride;
    const auto headroom = static_cast<std::uint16_t>(65535 - square);
    for (std::size_t i = 0; i < kLanes; ++i) {
      const std::uint16_t neighbour = std::min(std::min(before[i], behind[i]), headroom);
      best[i] = std::min(best[i], static_cast<std::uint16_t>(neighbour + square));
    }
  }
  std::memcpy(best_out, best, sizeof best);
}

/// One slice's work space: squares with `reach` rows of "far" before and behind, so that no neighbour lies
/// outside.
class Slice {
 public:
  Slice(std::size_t nx, std::size_t ny, int reach)
      : nx_(nx),
        ny_(ny),
        reach_(reach),
        far_(static_cast<std::uint16_t>((reach + 1) * (reach + 1))),
        width_((nx + kLanes - 1) / kLanes * kLanes),
        rows_(width_ * (ny + 2 * static_cast<std::size_t>(reach)), far_),
        row_(width_ + 2 * static_cast<std::size_t>(reach) + kLanes, far_),
        filled_(ny) {}

  /// Whether anything of the slice is in the band; then run() must follow.
  bool load(const std::uint8_t* distances) {
    bool any = false;
    for (std::size_t y = 0; y < ny_; ++y) {
      std::uint16_t* to = row(y);
      filled_[y] = any_below(distances + y * nx_, nx_, static_cast<std::uint8_t>(reach_ + 1)) ? 1 : 0;
      any = any || filled_[y] != 0;
      if (filled_[y] != 0) {
        squares(distances + y * nx_, to, nx_);
      } else {
        std::fill_n(to, nx_, far_);
      }
    }
    return any;
  }

  void run(const std::vector<std::int8_t>& orders_by_square, std::int8_t* orders) {
    for (std::size_t y = 0; y < ny_; ++y, orders += nx_) {
      if (!anything_near(y)) {
        std::memset(orders, orders_by_square.back(), nx_);
        continue;
      }
      std::uint16_t* line = row_.data() + reach_;
      for (std::size_t x = 0; x < nx_; x += kLanes) {
        nearest_in_line(row(y) + x, static_cast<std::ptrdiff_t>(width_), reach_, line + x);
      }
      std::fill(line + nx_, row_.data() + row_.size(), far_);
      for (std::size_t x = 0; x < nx_; x += kLanes) {
        std::uint16_t best[kLanes];
        nearest_in_line(line + x, 1, reach_, best);
        const std::size_t count = std::min(kLanes, nx_ - x);
        for (std::size_t i = 0; i < count; ++i) {
          orders[x + i] = orders_by_square[std::min<std::size_t>(best[i], orders_by_square.size() - 1)];
        }
      }
    }
  }

 private:
  std::uint16_t* row(std::size_t y) { return rows_.data() + (y + static_cast<std::size_t>(reach_)) * width_; }
  bool anything_near(std::size_t y) const {
    const auto reach = static_cast<std::size_t>(reach_);
    const std::size_t from = y > reach ? y - reach : 0, to = std::min(ny_, y + reach + 1);
    return std::memchr(filled_.data() + from, 1, to - from) != nullptr;
  }

  std::size_t nx_, ny_;
  int reach_;
  std::uint16_t far_;
  std::size_t width_;
  std::vector<std::uint16_t> rows_, row_;
  std::vector<std::uint8_t> filled_;
};

}  // namespace

void distance_along_z(std::uint8_t* voxels, const std::array<std::int32_t, 3>& size, std::uint8_t reach) {
  const std::size_t slice = static_cast<std::size_t>(size[0]) * static_cast<std::size_t>(size[1]);
  const auto slices = static_cast<std::size_t>(size[2]);
  const auto most = static_cast<std::uint8_t>(reach + 1);
  for (std::size_t z = 1; z < slices; ++z)
    step_away(voxels + (z - 1) * slice, voxels + z * slice, slice, most);
  for (std::size_t z = slices - 1; z-- > 0;)
    step_away(voxels + (z + 1) * slice, voxels + z * slice, slice, most);
}

void orders_of_slices(std::uint8_t* voxels, const std::array<std::int32_t, 3>& size, std::uint8_t reach,
                      const std::vector<std::int8_t>& orders_by_square) {
  const auto nx = static_cast<std::size_t>(size[0]), ny = static_cast<std::size_t>(size[1]);
  Slice slice(nx, ny, reach);
  for (std::size_t z = 0; z < static_cast<std::size_t>(size[2]); ++z) {
    std::uint8_t* here = voxels + z * nx * ny;
    if (slice.load(here)) {
      slice.run(orders_by_square, reinterpret_cast<std::int8_t*>(here));
    } else {
      std::memset(here, orders_by_square.back(), nx * ny);
    }
  }
}

}  // namespace phantom::voxel::detail

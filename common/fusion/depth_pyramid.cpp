#include "common/fusion/depth_pyramid.hpp"

#include <algorithm>
#include <array>

namespace phantom::fusion {
namespace {

int cells_for(int pixels, int cell) { return (pixels + cell - 1) / cell; }

/// Takes one more row into the columns.
void add_row(const float* __restrict row, std::size_t width, float* __restrict least,
             float* __restrict greatest, float* __restrict count) {
  for (std::size_t u = 0; u < width; ++u) {
    const float depth = row[u];
    least[u] = std::min(least[u], depth > 0.0F ? depth : DepthPyramid::kNone);
    greatest[u] = std::max(greatest[u], depth);
    count[u] += depth > 0.0F ? 1.0F : 0.0F;
  }
}

}  // namespace

void DepthPyramid::Level::resize(int cells_x, int cells_y) {
  width = cells_x;
  height = cells_y;
  const std::size_t count = static_cast<std::size_t>(cells_x) * static_cast<std::size_t>(cells_y);
  if (cells.size() < count) cells.resize(count);
}

void DepthPyramid::build_first(const PreparedDepth& depth) {
  constexpr int kCell = 1 << kCellBits;
  const auto width = static_cast<std::size_t>(depth.width());
  Level& level = levels_[0];
  level.resize(cells_for(depth.width(), kCell), cells_for(depth.height(), kCell));
  for (std::vector<float>* columns : {&least_, &greatest_, &count_})
    columns->resize(std::max(columns->size(), width));
  for (int y = 0; y < level.height; ++y) {
    std::fill_n(least_.begin(), width, kNone);
    std::fill_n(greatest_.begin(), width, 0.0F);
    std::fill_n(count_.begin(), width, 0.0F);
    const int end = std::min(depth.height(), (y + 1) * kCell);
    for (int v = y * kCell; v < end; ++v)
      add_row(depth.row(v), width, least_.data(), greatest_.data(), count_.data());
    for (int x = 0; x < level.width; ++x) {
      Cell cell;
      float count = 0.0F;
      const int last = std::min(depth.width(), (x + 1) * kCell);
      for (int u = x * kCell; u < last; ++u) {
        const auto column = static_cast<std::size_t>(u);
        cell.least = std::min(cell.least, least_[column]);
        cell.greatest = std::max(cell.greatest, greatest_[column]);
        count += count_[column];
      }
      cell.seen = 2.0F * count >= static_cast<float>((last - x * kCell) * (end - y * kCell));
      level.at(x, y) = cell;
    }
  }
}

void DepthPyramid::build(const PreparedDepth& depth) {
  build_first(depth);
  for (std::size_t i = 1; i < levels_.size(); ++i) {
    const Level& fine = levels_[i - 1];
    Level& level = levels_[i];
    level.resize(cells_for(fine.width, 2), cells_for(fine.height, 2));
    for (int y = 0; y < level.height; ++y) {
      for (int x = 0; x < level.width; ++x) {
        Cell cell{kNone, 0.0F, true};
        for (int k = 2 * y; k < std::min(fine.height, 2 * y + 2); ++k) {
          for (int j = 2 * x; j < std::min(fine.width, 2 * x + 2); ++j) {
            const Cell& part = fine.at(j, k);
            cell = {std::min(cell.least, part.least), std::max(cell.greatest, part.greatest),
                    cell.seen && part.seen};
          }
        }
        level.at(x, y) = cell;
      }
    }
  }
}

DepthPyramid::Depths DepthPyramid::in(int u0, int v0, int u1, int v1) const noexcept {
  constexpr int kAtOnce = 2;  // cells beyond the first, along an axis
  int bits = kCellBits;
  while (bits < kCellBits + kLevels - 1 &&
         ((u1 >> bits) - (u0 >> bits) > kAtOnce || (v1 >> bits) - (v0 >> bits) > kAtOnce))
    ++bits;
  const Level& level = levels_[static_cast<std::size_t>(bits - kCellBits)];
  Depths depths{kNone, 0.0F, true};
  for (int y = v0 >> bits; y <= v1 >> bits; ++y) {
    for (int x = u0 >> bits; x <= u1 >> bits; ++x) {
      const Cell& cell = level.at(x, y);
      depths = {std::min(depths.least_vox, cell.least), std::max(depths.greatest_vox, cell.greatest),
                depths.seen && cell.seen};
    }
  }
  return depths;
}

}  // namespace phantom::fusion

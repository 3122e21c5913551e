#include "common/fusion/depth_pyramid.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace phantom::fusion {
namespace {

int cells_for(int pixels, int cell) { return (pixels + cell - 1) / cell; }

/// Takes one more row into the columns.
void add_row(const float* __restrict row, std::size_t width, float* __restrict least,
             float* __restrict greatest, float* __restrict count) {
  for (std::size_t u = 0; u < width; ++u) {
    const float depth = std::abs(row[u]);
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

/// Calls `each` with x and y of the cells of the finest level, with their depths and the number of these.
template <class RowOf, class Each>
void DepthPyramid::for_cells(int width_px, int height_px, const RowOf& row_of, const Each& each) {
  constexpr int kCell = 1 << kCellBits;
  const auto width = static_cast<std::size_t>(width_px);
  for (std::vector<float>* columns : {&least_, &greatest_, &count_})
    columns->resize(std::max(columns->size(), width));
  for (int y = 0; y < cells_for(height_px, kCell); ++y) {
    std::fill_n(least_.begin(), width, kNone);
    std::fill_n(greatest_.begin(), width, 0.0F);
    std::fill_n(count_.begin(), width, 0.0F);
    const int end = std::min(height_px, (y + 1) * kCell);
    for (int v = y * kCell; v < end; ++v)
      add_row(row_of(v), width, least_.data(), greatest_.data(), count_.data());
    for (int x = 0; x < cells_for(width_px, kCell); ++x) {
      float least = kNone, greatest = 0.0F, count = 0.0F;
      const int last = std::min(width_px, (x + 1) * kCell);
      for (int u = x * kCell; u < last; ++u) {
        const auto column = static_cast<std::size_t>(u);
        least = std::min(least, least_[column]);
        greatest = std::max(greatest, greatest_[column]);
        count += count_[column];
      }
      each(x, y, least, greatest, count / static_cast<float>((last - x * kCell) * (end - y * kCell)));
    }
  }
}

void DepthPyramid::build_first(const PreparedDepth& depth) {
  constexpr int kCell = 1 << kCellBits;
  levels_[0].resize(cells_for(depth.width(), kCell), cells_for(depth.height(), kCell));
  for_cells(
      depth.width(), depth.height(), [&](int v) { return depth.row(v); },
      [&](int x, int y, float least, float greatest, float share) {
        levels_[0].at(x, y) = {least, greatest, share >= 0.5F};
      });
}

std::size_t DepthPyramid::cells_of(const PinholeCamera& camera) {
  constexpr int kCell = 1 << kCellBits;
  return static_cast<std::size_t>(cells_for(camera.width_px, kCell)) *
         static_cast<std::size_t>(cells_for(camera.height_px, kCell));
}

/// Marks the cells that are as before, by the depths that are fused: those at edges change with each image.
/// What is compared with follows the images slowly: their noise averages out, and a cell that changes differs
/// for a while. Where nothing was measured there is nothing to follow.
void DepthPyramid::compare(const PreparedDepth& depth, SeenCells& before, const Tolerance& tolerance) {
  constexpr float kFollowing = 1.0F / 16.0F;
  const bool known = before.known;
  before.known = true;
  changed_.resize(std::max(changed_.size(), before.least_vox.size()));
  std::size_t i = 0;
  for_cells(
      depth.width(), depth.height(), [&](int v) { return depth.fused_row(v); },
      [&](int, int, float least, float greatest, float) {
        float &least_before = before.least_vox[i], &greatest_before = before.greatest_vox[i];
        const float limit = tolerance.offset_vox + tolerance.slope * greatest * greatest;
        changed_[i++] =
            !known || std::abs(least - least_before) > limit || std::abs(greatest - greatest_before) > limit;
        const float part = known && least < kNone && least_before < kNone ? kFollowing : 1.0F;
        least_before += part * (least - least_before);
        greatest_before += part * (greatest - greatest_before);
      });
}

void DepthPyramid::build(const PreparedDepth& depth, SeenCells& before, const Tolerance& tolerance) {
  build_first(depth);
  compare(depth, before, tolerance);
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

bool DepthPyramid::steady(int u0, int v0, int u1, int v1) const noexcept {
  const auto width = static_cast<std::size_t>(levels_[0].width);
  for (int y = v0 >> kCellBits; y <= v1 >> kCellBits; ++y) {
    const auto row = changed_.begin() + static_cast<std::ptrdiff_t>(static_cast<std::size_t>(y) * width);
    if (std::any_of(row + (u0 >> kCellBits), row + (u1 >> kCellBits) + 1, [](auto c) { return c != 0; }))
      return false;
  }
  return true;
}

}  // namespace phantom::fusion

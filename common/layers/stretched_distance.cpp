#include "common/layers/stretched_distance.hpp"

#include <algorithm>
#include <bit>

#include "common/workspace/workspace.hpp"

namespace phantom::layers::detail {
namespace {

constexpr double kRoundingOfSquares = 1e-9;

/// Returns whether a solid voxel is at `x` of a row of the solid's box.
bool is_set(const std::uint64_t* boundary, const std::uint64_t* inside, std::int32_t x) {
  return ((boundary[x >> 6] | inside[x >> 6]) >> (x & 63) & 1) != 0;
}

/// Returns the steps that lead from `x` back (−1) or on (+1) to a solid voxel, and more than `most` if there
/// is none in so many steps or before the end of the row.
std::int32_t steps_to_solid(const std::uint64_t* boundary, const std::uint64_t* inside, std::int32_t length,
                            std::int32_t x, std::int32_t way, std::int32_t most) {
  for (std::int32_t step = 0; step <= most; ++step) {
    const std::int32_t at = x + way * step;
    if (way < 0 ? at < 0 : at >= length) break;
    if (at >= 0 && at < length && is_set(boundary, inside, at)) return step;
  }
  return most + 1;
}

}  // namespace

StretchedDistance::StretchedDistance(const voxelise::SolidVoxels& solid, const OrderSteps& steps,
                                     const Eigen::Vector3d& stretch)
    : solid_(solid), steps_(steps) {
  for (const std::uint16_t square : steps.above) above_.push_back(square * (1.0 + kRoundingOfSquares));
  far_ = above_.back() + 1.0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double side = stretch[static_cast<Eigen::Index>(axis)];
    for (int k = 0; side * k * side * k <= above_.back(); ++k)
      square_of_[axis].push_back(side * k * side * k);
  }
  rows_.resize(kEdge + 2 * (square_of_[1].size() - 1));
  in_rows_.resize(rows_.size());
  in_slices_.resize(kEdge + 2 * (square_of_[2].size() - 1));
  slices_.resize(kEdge * in_slices_.size());
}

void StretchedDistance::run(const BrickBlock& block) {
  std::size_t i = 0;
  for (std::int32_t z = 0; z < block.nz; ++z) {
    for (std::int32_t y = 0; y < block.ny; ++y) {
      for (std::int32_t x = 0; x < block.nx; ++x, ++i) {
        if (block.bricks[i] != nullptr)
          write(block.min + workspace::kBrickEdge * workspace::Index3{x, y, z}, block.bricks[i]);
      }
    }
  }
}

/// Sets the squares of the voxels from `first` on to those of the nearest solid voxel of their row. Returns
/// false if none is in reach of any.
bool StretchedDistance::nearest_along_x(workspace::Index3 first, Row& squares) const {
  const workspace::Index3 in = first - solid_.box.min;
  const std::int32_t length = solid_.box.size[0], edge = static_cast<std::int32_t>(kEdge);
  if (in.y < 0 || in.z < 0 || in.y >= solid_.box.size[1] || in.z >= solid_.box.size[2]) return false;
  const std::vector<double>& square_of = square_of_[0];
  const auto reach = static_cast<std::int32_t>(square_of.size()) - 1;
  const std::uint64_t* const boundary = solid_.boundary.row(in.y, in.z);
  const std::uint64_t* const inside = solid_.inside.row(in.y, in.z);
  const std::int32_t from = std::max(0, in.x - reach) >> 6,
                     to = std::min(length - 1, in.x + edge - 1 + reach);
  bool any = false;
  for (std::int32_t word = from; !any && 64 * word <= to; ++word) any = (boundary[word] | inside[word]) != 0;
  if (!any) return false;
  const auto next = [&](std::int32_t x, std::int32_t before) {
    return x >= 0 && x < length && is_set(boundary, inside, x) ? 0 : std::min(before, reach) + 1;
  };
  std::array<std::int32_t, kEdge> steps;
  std::int32_t count = steps_to_solid(boundary, inside, length, in.x - 1, -1, reach);
  for (std::int32_t x = 0; x < edge; ++x) steps[static_cast<std::size_t>(x)] = count = next(in.x + x, count);
  count = steps_to_solid(boundary, inside, length, in.x + edge, 1, reach);
  std::int32_t least = reach + 1;
  for (std::int32_t x = edge - 1; x >= 0; --x) {
    count = next(in.x + x, count);
    const std::int32_t step = std::min(count, steps[static_cast<std::size_t>(x)]);
    squares[static_cast<std::size_t>(x)] = step <= reach ? square_of[static_cast<std::size_t>(step)] : far_;
    least = std::min(least, step);
  }
  return least <= reach;
}

/// Lowers squares to those of other voxels, `more` away along the next axis.
void StretchedDistance::lower(const Row& from, double more, Row& to) const {
  for (std::size_t x = 0; x < kEdge; ++x) to[x] = std::min(to[x], from[x] + more);
}

/// Sets the squares of a brick's rows in one slice, from voxel `first` on. Returns false if nothing is in
/// reach.
bool StretchedDistance::nearest_along_y(workspace::Index3 first, Row* squares) {
  const std::vector<double>& square_of = square_of_[1];
  const std::size_t reach = square_of.size() - 1;
  bool any = false;
  for (std::size_t y = 0; y < rows_.size(); ++y) {
    const std::int32_t at = first.y + static_cast<std::int32_t>(y) - static_cast<std::int32_t>(reach);
    in_rows_[y] = nearest_along_x({first.x, at, first.z}, rows_[y]) ? 1 : 0;
    any = any || in_rows_[y] != 0;
  }
  if (!any) return false;
  for (std::size_t y = 0; y < kEdge; ++y) {
    squares[y].fill(far_);
    for (std::size_t k = 0; k <= reach; ++k) {
      if (in_rows_[reach + y + k] != 0) lower(rows_[reach + y + k], square_of[k], squares[y]);
      if (in_rows_[reach + y - k] != 0) lower(rows_[reach + y - k], square_of[k], squares[y]);
    }
  }
  return true;
}

/// Sets the squares of the brick's rows of one slice; `plane` is that slice, as nearest_along_y() left it.
void StretchedDistance::nearest_along_z(const Row* plane, Row* squares) const {
  const std::vector<double>& square_of = square_of_[2];
  const auto slice = static_cast<std::size_t>(plane - slices_.data()) / kEdge;
  for (std::size_t y = 0; y < kEdge; ++y) squares[y].fill(far_);
  for (std::size_t k = 0; k < square_of.size(); ++k) {
    for (const std::size_t z : {slice + k, slice - k}) {
      if (in_slices_[z] == 0) continue;
      for (std::size_t y = 0; y < kEdge; ++y) lower(slices_[z * kEdge + y], square_of[k], squares[y]);
    }
  }
}

/// Writes the orders of the brick whose lower corner is at `corner`.
void StretchedDistance::write(workspace::Index3 corner, std::int8_t* orders) {
  const std::size_t reach = square_of_[2].size() - 1;
  for (std::size_t z = 0; z < in_slices_.size(); ++z) {
    const std::int32_t at = corner.z + static_cast<std::int32_t>(z) - static_cast<std::int32_t>(reach);
    in_slices_[z] = nearest_along_y({corner.x, corner.y, at}, &slices_[z * kEdge]) ? 1 : 0;
  }
  std::array<Row, kEdge> squares;
  for (std::size_t z = 0; z < kEdge; ++z) {
    nearest_along_z(&slices_[(reach + z) * kEdge], squares.data());
    for (std::size_t y = 0; y < kEdge; ++y) {
      for (std::size_t x = 0; x < kEdge; ++x) {
        const workspace::Index3 v =
            corner + workspace::Index3{static_cast<std::int32_t>(x), static_cast<std::int32_t>(y),
                                       static_cast<std::int32_t>(z)};
        const auto place = std::lower_bound(above_.begin(), above_.end(), squares[y][x]) - above_.begin();
        const workspace::Index3 in = v - solid_.box.min;
        const bool boundary = place == 0 && solid_.boundary.get(in);
        orders[workspace::brick_offset(v)] =
            boundary ? workspace::kOrderBoundary : steps_.order[static_cast<std::size_t>(place)];
      }
    }
  }
}

}  // namespace phantom::layers::detail

#include "common/voxel/layers.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cstring>
#include <iterator>

#include "common/core/parallel.hpp"
#include "common/voxel/banded_distance.hpp"
#include "common/voxel/workspace.hpp"

namespace phantom::voxel {
namespace {

using detail::BandedDistance;
using detail::BrickBlock;
using detail::OrderSteps;
using detail::SolidRows;

constexpr std::int32_t brick_of(std::int32_t voxel) { return voxel >> 5; }  // rounds down, below 0 too
static_assert(kBrickEdge == 32);

OrderSteps steps_of(const LayerProfile& profile) {
  OrderSteps steps;
  steps.reach = static_cast<std::uint8_t>(profile.reach_vox());
  int until = 0;
  const auto begin = [&](std::int8_t order, int thickness) {
    steps.above.push_back(static_cast<std::uint16_t>(until * until));
    steps.order.push_back(order);
    until += thickness;
  };
  steps.order.push_back(kOrderInterior);
  if (profile.guard_vox > 0) begin(kOrderGuard, profile.guard_vox);
  for (std::size_t i = 0; i < profile.thickness_vox.size(); ++i)
    begin(static_cast<std::int8_t>(i + 1), profile.thickness_vox[i]);
  begin(kOrderFree, 0);
  return steps;
}

/// What cubes of a brick's size hold of the solid, at bricks' places (which may lie beyond the grid). One entry per cube,
/// x fastest; arrays of their own, so that rows are looked at many at a time.
struct Cells {
  explicit Cells(const VoxelBox& box)
      : min{brick_of(box.min.x), brick_of(box.min.y), brick_of(box.min.z)},
        size{brick_of(box.min.x + box.size[0] - 1) - min.x + 1, brick_of(box.min.y + box.size[1] - 1) - min.y + 1,
             brick_of(box.min.z + box.size[2] - 1) - min.z + 1} {
    for (auto* values : {&x_bits, &y_bits, &z_bits, &full_rows, &boundary}) values->resize(index(0, 0, size[2]));
  }
  std::size_t index(std::int32_t x, std::int32_t y, std::int32_t z) const {
    return (static_cast<std::size_t>(z) * static_cast<std::size_t>(size[1]) + static_cast<std::size_t>(y)) *
               static_cast<std::size_t>(size[0]) + static_cast<std::size_t>(x);
  }
  bool all_interior(std::size_t i) const { return full_rows[i] == kBrickEdge * kBrickEdge && boundary[i] == 0; }

  Index3 min;  // a brick's address
  std::array<std::int32_t, 3> size{};
  std::vector<std::uint32_t> x_bits, y_bits, z_bits;  // bit i: something is solid where the coordinate's last 5 bits are i
  std::vector<std::uint32_t> full_rows;               // rows along x that are solid from end to end
  std::vector<std::uint32_t> boundary;                // not 0: boundary may pass
};

/// Takes a row of the solid, 32 bits a cell.
void look_at_row(const std::uint8_t* bits, std::int32_t y, std::int32_t z, Cells& cells, std::size_t first) {
  const std::uint32_t y_bit = std::uint32_t{1} << (y & 31), z_bit = std::uint32_t{1} << (z & 31);
  std::uint32_t *x_bits = cells.x_bits.data() + first, *y_bits = cells.y_bits.data() + first, *z_bits = cells.z_bits.data() + first,
                *full_rows = cells.full_rows.data() + first;
  for (std::int32_t i = 0; i < cells.size[0]; ++i) {
    std::uint32_t word;
    std::memcpy(&word, bits + 4 * i, sizeof word);
    const std::uint32_t any = word != 0 ? ~std::uint32_t{0} : 0;
    x_bits[i] |= word;
    y_bits[i] |= any & y_bit;
    z_bits[i] |= any & z_bit;
    full_rows[i] += word == ~std::uint32_t{0} ? 1 : 0;
  }
}

void look_at_boundary(const SolidVoxels& solid, std::int32_t y, std::int32_t z, Cells& cells, std::size_t first) {
  const std::uint64_t* boundary = solid.boundary.row(y - solid.box.min.y, z - solid.box.min.z);
  for (std::size_t i = 0; i < solid.boundary.words_per_row(); ++i) {
    if (boundary[i] == 0) continue;
    const std::int32_t x = solid.box.min.x + static_cast<std::int32_t>(i * 64);
    const std::int32_t from = brick_of(x + std::countr_zero(boundary[i])), to = brick_of(x + 63 - std::countl_zero(boundary[i]));
    for (std::int32_t at = from; at <= to; ++at) cells.boundary[first + static_cast<std::size_t>(at - cells.min.x)] = 1;
  }
}

Cells look_at(const SolidVoxels& solid, const SolidRows& rows, int threads) {
  Cells cells(solid.box);
  const std::int32_t from_x = cells.min.x * kBrickEdge, from_y = solid.box.min.y, to_y = from_y + solid.box.size[1];
  core::parallel_for(threads, static_cast<std::size_t>(cells.size[2]), [&](std::size_t layer, std::size_t) {
    const std::int32_t from_z = (cells.min.z + static_cast<std::int32_t>(layer)) * kBrickEdge;
    for (std::int32_t y = from_y; y < to_y; ++y) {
      const std::size_t first = cells.index(0, brick_of(y) - cells.min.y, static_cast<std::int32_t>(layer));
      const SolidRows::Lines lines = rows.lines(from_x, y, from_z, from_z + kBrickEdge);
      const std::uint8_t* bits = lines.bits;
      for (std::int32_t z = lines.first; z < lines.last; ++z, bits += lines.stride) {
        look_at_row(bits, y, z, cells, first);
        look_at_boundary(solid, y, z, cells, first);
      }
    }
  });
  return cells;
}

enum class Need : std::uint8_t { kNothing, kOrders, kInterior };

/// What there is to do: per brick of a box of bricks.
struct Plan {
  BrickKey min;
  std::array<std::int32_t, 3> size{};
  std::vector<Need> need;

  bool contains(BrickKey key) const {
    return key.x >= min.x && key.y >= min.y && key.z >= min.z && key.x < min.x + size[0] && key.y < min.y + size[1] &&
           key.z < min.z + size[2];
  }
  Need& at(BrickKey key) {
    return need[(static_cast<std::size_t>(key.z - min.z) * static_cast<std::size_t>(size[1]) + static_cast<std::size_t>(key.y - min.y)) *
                    static_cast<std::size_t>(size[0]) + static_cast<std::size_t>(key.x - min.x)];
  }
};

/// The smallest box of voxels, in addresses of the grid, that holds a cell's solid.
struct Bounds {
  Bounds(const Cells& cells, Index3 cell, std::size_t i) {
    const std::array<std::int32_t, 3> first{(cells.min.x + cell.x) * kBrickEdge, (cells.min.y + cell.y) * kBrickEdge,
                                            (cells.min.z + cell.z) * kBrickEdge};
    const std::array<std::uint32_t, 3> bits{cells.x_bits[i], cells.y_bits[i], cells.z_bits[i]};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      low[axis] = first[axis] + std::countr_zero(bits[axis]);
      high[axis] = first[axis] + 31 - std::countl_zero(bits[axis]);
    }
  }
  /// Squared distance to the nearest voxel of a brick.
  std::int64_t square_to(BrickKey key) const {
    const std::array<std::int32_t, 3> brick{key.x * kBrickEdge, key.y * kBrickEdge, key.z * kBrickEdge};
    std::int64_t square = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::int64_t away = std::max({0, brick[axis] - high[axis], low[axis] - (brick[axis] + kBrickEdge - 1)});
      square += away * away;
    }
    return square;
  }
  std::array<std::int32_t, 3> low, high;
};

void need_around(const Bounds& bounds, int reach, Plan& plan) {
  const auto first = [&](std::size_t axis, std::int32_t least) { return std::max(brick_of(bounds.low[axis] - reach), least); };
  const auto last = [&](std::size_t axis, std::int32_t least) {
    return std::min(brick_of(bounds.high[axis] + reach), least + plan.size[axis] - 1);
  };
  BrickKey key;
  for (key.z = first(2, plan.min.z); key.z <= last(2, plan.min.z); ++key.z) {
    for (key.y = first(1, plan.min.y); key.y <= last(1, plan.min.y); ++key.y) {
      for (key.x = first(0, plan.min.x); key.x <= last(0, plan.min.x); ++key.x) {
        Need& need = plan.at(key);
        if (need == Need::kNothing && bounds.square_to(key) <= std::int64_t{reach} * reach) need = Need::kOrders;
      }
    }
  }
}

Plan plan_for(const Cells& cells, int reach, const VoxelBox& part, const VoxelBox& solid_box) {
  Plan plan;
  const VoxelBox reached = solid_box.grown(reach).intersection(part);
  if (reached.empty()) return plan;
  plan.min = {brick_of(reached.min.x), brick_of(reached.min.y), brick_of(reached.min.z)};
  plan.size = {brick_of(reached.min.x + reached.size[0] - 1) - plan.min.x + 1, brick_of(reached.min.y + reached.size[1] - 1) - plan.min.y + 1,
               brick_of(reached.min.z + reached.size[2] - 1) - plan.min.z + 1};
  plan.need.resize(static_cast<std::size_t>(plan.size[0]) * static_cast<std::size_t>(plan.size[1]) * static_cast<std::size_t>(plan.size[2]));
  Index3 cell;
  for (cell.z = 0; cell.z < cells.size[2]; ++cell.z) {
    for (cell.y = 0; cell.y < cells.size[1]; ++cell.y) {
      for (cell.x = 0; cell.x < cells.size[0]; ++cell.x) {
        const std::size_t i = cells.index(cell.x, cell.y, cell.z);
        if (cells.x_bits[i] == 0) continue;
        need_around(Bounds(cells, cell, i), reach, plan);
        const BrickKey own{cells.min.x + cell.x, cells.min.y + cell.y, cells.min.z + cell.z};
        if (cells.all_interior(i) && plan.contains(own)) plan.at(own) = Need::kInterior;
      }
    }
  }
  return plan;
}

/// Bricks that are computed together: they share what lies around them, so more at once for a longer reach.
struct BlockShape {
  std::int32_t along_x, across;
};
BlockShape shape_for(int reach) {
  constexpr auto kAlong = static_cast<std::int32_t>(detail::kMostBricksAlongX);
  return reach <= 32 ? BlockShape{kAlong, 1} : reach <= 96 ? BlockShape{kAlong, 2} : BlockShape{kAlong, 4};
}

/// Runs of bricks along x that need orders. The keys of a block's bricks, x fastest; what is not needed is left out later.
struct Task {
  BrickKey min;
  std::int32_t nx, ny, nz;
};

std::vector<Task> tasks_of(Plan& plan, BlockShape shape) {
  std::vector<Task> tasks;
  BrickKey at = plan.min;
  for (at.z = plan.min.z; at.z < plan.min.z + plan.size[2]; at.z += shape.across) {
    for (at.y = plan.min.y; at.y < plan.min.y + plan.size[1]; at.y += shape.across) {
      const std::int32_t nz = std::min(shape.across, plan.min.z + plan.size[2] - at.z), ny = std::min(shape.across, plan.min.y + plan.size[1] - at.y);
      const auto needed = [&](std::int32_t x) {
        for (std::int32_t z = 0; z < nz; ++z) {
          for (std::int32_t y = 0; y < ny; ++y) {
            if (plan.at({x, at.y + y, at.z + z}) == Need::kOrders) return true;
          }
        }
        return false;
      };
      std::int32_t length = 0;
      for (std::int32_t x = plan.min.x; x <= plan.min.x + plan.size[0]; ++x) {
        const bool more = x < plan.min.x + plan.size[0] && needed(x);
        if (length > 0 && (!more || length == shape.along_x)) {
          tasks.push_back({{x - length, at.y, at.z}, length, ny, nz});
          length = 0;
        }
        if (more) ++length;
      }
    }
  }
  return tasks;
}

/// Boundary voxels of a block's bricks are marked as such.
void mark_boundary(const SolidVoxels& solid, const BrickBlock& block) {
  const VoxelBox here = VoxelBox{block.min, {block.nx * kBrickEdge, block.ny * kBrickEdge, block.nz * kBrickEdge}}.intersection(solid.box);
  if (here.empty()) return;
  const std::int32_t low = here.min.x - solid.box.min.x, high = low + here.size[0];
  for (std::int32_t z = here.min.z; z < here.min.z + here.size[2]; ++z) {
    for (std::int32_t y = here.min.y; y < here.min.y + here.size[1]; ++y) {
      const std::uint64_t* row = solid.boundary.row(y - solid.box.min.y, z - solid.box.min.z);
      const std::size_t first = (static_cast<std::size_t>((z - block.min.z) / kBrickEdge) * static_cast<std::size_t>(block.ny) +
                                 static_cast<std::size_t>((y - block.min.y) / kBrickEdge)) * static_cast<std::size_t>(block.nx);
      for (std::int32_t word = low / 64; word <= (high - 1) / 64; ++word) {
        for (std::uint64_t bits = row[word]; bits != 0; bits &= bits - 1) {
          const std::int32_t bit = word * 64 + std::countr_zero(bits);
          if (bit < low || bit >= high) continue;
          const std::int32_t x = bit + solid.box.min.x;
          std::int8_t* brick = block.bricks[first + static_cast<std::size_t>((x - block.min.x) / kBrickEdge)];
          if (brick == nullptr) continue;
          brick[brick_offset(static_cast<std::uint32_t>(x & 31), static_cast<std::uint32_t>(y & 31), static_cast<std::uint32_t>(z & 31))] =
              kOrderBoundary;
        }
      }
    }
  }
}

/// Voxels of the last bricks that lie beyond the grid are free.
void cut_off(const VoxelBox& part, BrickKey key, std::int8_t* orders) {
  const VoxelBox whole = box_of(key), inside = whole.intersection(part);
  if (inside.size == whole.size) return;
  for (std::int32_t z = 0; z < kBrickEdge; ++z) {
    for (std::int32_t y = 0; y < kBrickEdge; ++y) {
      for (std::int32_t x = 0; x < kBrickEdge; ++x) {
        if (x < inside.size[0] && y < inside.size[1] && z < inside.size[2]) continue;
        orders[brick_offset(static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y), static_cast<std::uint32_t>(z))] = kOrderFree;
      }
    }
  }
}

bool all_free(const std::int8_t* orders) {
  static const std::array<std::int8_t, kBrickVoxels> kFree{};
  return std::memcmp(orders, kFree.data(), kBrickVoxels) == 0;
}

/// One thread's share of the work.
class Worker {
 public:
  Worker(const SolidVoxels& solid, const SolidRows& rows, const OrderSteps& steps, const VoxelBox& part, BrickMemory& memory)
      : solid_(solid), part_(part), memory_(memory), distance_(rows, steps) {}

  void run(const Task& task, Plan& plan) {
    block_.min = {task.min.x * kBrickEdge, task.min.y * kBrickEdge, task.min.z * kBrickEdge};
    block_.nx = task.nx;
    block_.ny = task.ny;
    block_.nz = task.nz;
    block_.bricks.clear();
    std::vector<ObjectBricks::Part> made;
    for (std::int32_t z = 0; z < task.nz; ++z) {
      for (std::int32_t y = 0; y < task.ny; ++y) {
        for (std::int32_t x = 0; x < task.nx; ++x) {
          const BrickKey key{task.min.x + x, task.min.y + y, task.min.z + z};
          const bool needed = plan.at(key) == Need::kOrders;
          if (needed) made.push_back({key, memory_.take()});
          block_.bricks.push_back(needed ? made.back().orders.get() : nullptr);
        }
      }
    }
    distance_.run(block_);
    mark_boundary(solid_, block_);
    for (ObjectBricks::Part& brick : made) {
      cut_off(part_, brick.key, brick.orders.get());
      if (all_free(brick.orders.get())) {
        memory_.give_back(std::move(brick.orders));
      } else {
        parts.push_back(std::move(brick));
      }
    }
  }

  std::vector<ObjectBricks::Part> parts;

 private:
  const SolidVoxels& solid_;
  VoxelBox part_;
  BrickMemory& memory_;
  BandedDistance distance_;
  BrickBlock block_;
};

void add_interior(Plan& plan, std::vector<ObjectBricks::Part>& parts) {
  BrickKey key;
  for (key.z = plan.min.z; key.z < plan.min.z + plan.size[2]; ++key.z) {
    for (key.y = plan.min.y; key.y < plan.min.y + plan.size[1]; ++key.y) {
      for (key.x = plan.min.x; key.x < plan.min.x + plan.size[0]; ++key.x) {
        if (plan.at(key) == Need::kInterior) parts.push_back({key, nullptr});
      }
    }
  }
}

}  // namespace

ObjectBricks distance_bricks(const SolidVoxels& solid, const LayerProfile& profile, const VoxelBox& part,
                             const LayerOptions& options) {
  if (solid.box.empty()) return {};
  const OrderSteps steps = steps_of(profile);
  const BlockShape shape = shape_for(steps.reach);
  const SolidRows rows(solid, 2 * (steps.reach + kBrickEdge), options.threads);
  Plan plan = plan_for(look_at(solid, rows, options.threads), steps.reach, part, solid.box);
  const std::vector<Task> tasks = tasks_of(plan, shape);
  BrickMemory memory(static_cast<std::size_t>(std::count(plan.need.begin(), plan.need.end(), Need::kOrders)));
  std::vector<Worker> workers;
  for (int i = 0; i < std::max(1, options.threads); ++i) workers.emplace_back(solid, rows, steps, part, memory);
  std::atomic<bool> stopped = false;
  core::parallel_for(options.threads, tasks.size(), [&](std::size_t i, std::size_t worker) {
    if (stopped) return;
    if (worker == 0 && options.go_on && !options.go_on(static_cast<double>(i) / static_cast<double>(tasks.size()))) stopped = true;
    workers[worker].run(tasks[i], plan);
  });
  if (stopped) return {};
  std::vector<ObjectBricks::Part> parts;
  for (Worker& worker : workers) std::move(worker.parts.begin(), worker.parts.end(), std::back_inserter(parts));
  add_interior(plan, parts);
  return ObjectBricks(std::move(parts));
}

}  // namespace phantom::voxel

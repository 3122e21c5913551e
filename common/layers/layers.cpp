#include "common/layers/layers.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cstring>
#include <iterator>

#include "common/core/parallel.hpp"
#include "common/layers/banded_distance.hpp"
#include "common/workspace/workspace.hpp"

namespace phantom::layers {
namespace {

using detail::BandedDistance;
using detail::BrickBlock;
using detail::Cells;
using detail::OrderSteps;
using detail::SolidRows;

OrderSteps steps_of(const workspace::LayerProfile& profile) {
  OrderSteps steps;
  steps.reach = static_cast<std::uint8_t>(profile.reach_vox());
  int until = 0;
  const auto begin = [&](std::int8_t order, int thickness) {
    steps.above.push_back(static_cast<std::uint16_t>(until * until));
    steps.order.push_back(order);
    until += thickness;
  };
  steps.order.push_back(workspace::kOrderInterior);
  if (profile.guard_vox > 0) begin(workspace::kOrderGuard, profile.guard_vox);
  for (std::size_t i = 0; i < profile.thickness_vox.size(); ++i)
    begin(static_cast<std::int8_t>(i + 1), profile.thickness_vox[i]);
  begin(workspace::kOrderFree, 0);
  return steps;
}

enum class Need : std::uint8_t { kNothing, kOrders, kInterior };

/// What to do for each brick of a box of bricks.
struct Plan {
  workspace::BrickKey min;
  std::array<std::int32_t, 3> size{};
  std::vector<Need> need;

  bool contains(workspace::BrickKey key) const {
    return key.x >= min.x && key.y >= min.y && key.z >= min.z && key.x < min.x + size[0] &&
           key.y < min.y + size[1] && key.z < min.z + size[2];
  }
  Need& at(workspace::BrickKey key) {
    return need[(static_cast<std::size_t>(key.z - min.z) * static_cast<std::size_t>(size[1]) +
                 static_cast<std::size_t>(key.y - min.y)) *
                    static_cast<std::size_t>(size[0]) +
                static_cast<std::size_t>(key.x - min.x)];
  }
};

/// The smallest box of voxels, in addresses of the grid, that holds a cell's solid.
struct Bounds {
  Bounds(const Cells& cells, workspace::Index3 cell, std::size_t i) {
    const std::array<std::int32_t, 3> first{(cells.min.x + cell.x) * workspace::kBrickEdge,
                                            (cells.min.y + cell.y) * workspace::kBrickEdge,
                                            (cells.min.z + cell.z) * workspace::kBrickEdge};
    const std::array<std::uint32_t, 3> bits{cells.bits[i].x, cells.bits[i].y, cells.bits[i].z};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      low[axis] = first[axis] + std::countr_zero(bits[axis]);
      high[axis] = first[axis] + 31 - std::countl_zero(bits[axis]);
    }
  }
  /// Returns the squared distance to the nearest voxel of a brick.
  std::int64_t square_to(workspace::BrickKey key) const {
    const std::array<std::int32_t, 3> brick{key.x * workspace::kBrickEdge, key.y * workspace::kBrickEdge,
                                            key.z * workspace::kBrickEdge};
    std::int64_t square = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::int64_t away =
          std::max({0, brick[axis] - high[axis], low[axis] - (brick[axis] + workspace::kBrickEdge - 1)});
      square += away * away;
    }
    return square;
  }
  std::array<std::int32_t, 3> low, high;
};

void need_around(const Bounds& bounds, int reach, Plan& plan) {
  const auto first = [&](std::size_t axis, std::int32_t least) {
    return std::max(workspace::brick_along(bounds.low[axis] - reach), least);
  };
  const auto last = [&](std::size_t axis, std::int32_t least) {
    return std::min(workspace::brick_along(bounds.high[axis] + reach), least + plan.size[axis] - 1);
  };
  workspace::BrickKey key;
  for (key.z = first(2, plan.min.z); key.z <= last(2, plan.min.z); ++key.z) {
    for (key.y = first(1, plan.min.y); key.y <= last(1, plan.min.y); ++key.y) {
      for (key.x = first(0, plan.min.x); key.x <= last(0, plan.min.x); ++key.x) {
        Need& need = plan.at(key);
        if (need == Need::kNothing && bounds.square_to(key) <= std::int64_t{reach} * reach)
          need = Need::kOrders;
      }
    }
  }
}

Plan plan_for(const Cells& cells, int reach, const workspace::VoxelBox& part,
              const workspace::VoxelBox& solid_box) {
  Plan plan;
  const workspace::VoxelBox reached = solid_box.grown(reach).intersection(part);
  if (reached.empty()) return plan;
  plan.min = {workspace::brick_along(reached.min.x), workspace::brick_along(reached.min.y),
              workspace::brick_along(reached.min.z)};
  plan.size = {workspace::brick_along(reached.min.x + reached.size[0] - 1) - plan.min.x + 1,
               workspace::brick_along(reached.min.y + reached.size[1] - 1) - plan.min.y + 1,
               workspace::brick_along(reached.min.z + reached.size[2] - 1) - plan.min.z + 1};
  plan.need.resize(static_cast<std::size_t>(plan.size[0]) * static_cast<std::size_t>(plan.size[1]) *
                   static_cast<std::size_t>(plan.size[2]));
  workspace::Index3 cell;
  for (cell.z = 0; cell.z < cells.size[2]; ++cell.z) {
    for (cell.y = 0; cell.y < cells.size[1]; ++cell.y) {
      for (cell.x = 0; cell.x < cells.size[0]; ++cell.x) {
        const std::size_t i = cells.index(cell.x, cell.y, cell.z);
        if (cells.bits[i].x == 0) continue;
        need_around(Bounds(cells, cell, i), reach, plan);
        const workspace::BrickKey own{cells.min.x + cell.x, cells.min.y + cell.y, cells.min.z + cell.z};
        if (cells.bits[i].interior && plan.contains(own)) plan.at(own) = Need::kInterior;
      }
    }
  }
  return plan;
}

/// Number of bricks that are computed together. They share their surroundings, so a longer reach calls for
/// more.
struct BlockShape {
  std::int32_t along_x, across;
};
BlockShape shape_for(int reach) {
  constexpr auto kAlong = static_cast<std::int32_t>(detail::kMostBricksAlongX);
  return {kAlong, reach <= 32 ? 1 : reach <= 96 ? 2 : 4};
}

/// Blocks of one thread, in sequence along y. Each reuses some results of the previous one.
struct Task {
  workspace::BrickKey min;
  std::int32_t nx, ny, nz;           // bricks of a block
  std::vector<std::int32_t> blocks;  // along y, rising: only those with bricks that need orders
};

/// Returns the blocks of bricks from `min` to `to_x` in nz layers; the task may have none.
Task task_of(Plan& plan, workspace::BrickKey min, std::int32_t to_x, std::int32_t nz, std::int32_t across) {
  Task task{min, 0, across, nz, {}};
  std::int32_t first_x = to_x, last_x = min.x - 1;
  for (std::int32_t y = min.y; y < plan.min.y + plan.size[1]; ++y) {
    for (std::int32_t z = min.z; z < min.z + nz; ++z) {
      for (std::int32_t x = min.x; x < to_x; ++x) {
        if (plan.at({x, y, z}) != Need::kOrders) continue;
        first_x = std::min(first_x, x);
        last_x = std::max(last_x, x);
        const std::int32_t block = (y - min.y) / across;
        if (task.blocks.empty() || task.blocks.back() != block) task.blocks.push_back(block);
      }
    }
  }
  task.min.x = first_x;
  task.nx = last_x - first_x + 1;
  return task;
}

std::vector<Task> tasks_of(Plan& plan, BlockShape shape) {
  std::vector<Task> tasks;
  workspace::BrickKey at = plan.min;
  for (at.z = plan.min.z; at.z < plan.min.z + plan.size[2]; at.z += shape.across) {
    for (at.x = plan.min.x; at.x < plan.min.x + plan.size[0]; at.x += shape.along_x) {
      Task task = task_of(plan, at, std::min(at.x + shape.along_x, plan.min.x + plan.size[0]),
                          std::min(shape.across, plan.min.z + plan.size[2] - at.z), shape.across);
      if (!task.blocks.empty()) tasks.push_back(std::move(task));
    }
  }
  return tasks;
}

/// Makes the voxels of the last bricks that lie beyond the grid free.
void cut_off(const workspace::VoxelBox& part, workspace::BrickKey key, std::int8_t* orders) {
  const workspace::VoxelBox whole = workspace::box_of(key), inside = whole.intersection(part);
  if (inside.size == whole.size) return;
  for (std::int32_t z = 0; z < workspace::kBrickEdge; ++z) {
    for (std::int32_t y = 0; y < workspace::kBrickEdge; ++y) {
      const bool row_inside = y < inside.size[1] && z < inside.size[2];
      for (std::int32_t x = row_inside ? inside.size[0] : 0; x < workspace::kBrickEdge; ++x)
        orders[workspace::brick_offset(static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y),
                                       static_cast<std::uint32_t>(z))] = workspace::kOrderFree;
    }
  }
}

bool all_free(const std::int8_t* orders) {
  static const std::array<std::int8_t, workspace::kBrickVoxels> kFree{};
  return std::memcmp(orders, kFree.data(), workspace::kBrickVoxels) == 0;
}

/// One thread's share of the work.
class Worker {
 public:
  Worker(const SolidRows& rows, const OrderSteps& steps, const workspace::VoxelBox& part,
         workspace::BrickMemory& memory)
      : part_(part), memory_(memory), distance_(rows, steps) {}

  void run(const Task& task, Plan& plan) {
    for (const std::int32_t block : task.blocks) run_block(task, task.min.y + block * task.ny, plan);
  }

  std::vector<workspace::ObjectBricks::Part> parts;

 private:
  void run_block(const Task& task, std::int32_t from_y, Plan& plan) {
    block_.min = {task.min.x * workspace::kBrickEdge, from_y * workspace::kBrickEdge,
                  task.min.z * workspace::kBrickEdge};
    block_.nx = task.nx;
    block_.ny = task.ny;
    block_.nz = task.nz;
    block_.bricks.clear();
    std::vector<workspace::ObjectBricks::Part> made;
    for (std::int32_t z = 0; z < task.nz; ++z) {
      for (std::int32_t y = 0; y < task.ny; ++y) {
        for (std::int32_t x = 0; x < task.nx; ++x) {
          const workspace::BrickKey key{task.min.x + x, from_y + y, task.min.z + z};
          const bool needed = plan.contains(key) && plan.at(key) == Need::kOrders;
          if (needed) made.push_back({key, memory_.take()});
          block_.bricks.push_back(needed ? made.back().orders.get() : nullptr);
        }
      }
    }
    distance_.run(block_);
    for (workspace::ObjectBricks::Part& brick : made) {
      cut_off(part_, brick.key, brick.orders.get());
      if (all_free(brick.orders.get())) {
        memory_.give_back(std::move(brick.orders));
      } else {
        parts.push_back(std::move(brick));
      }
    }
  }

  workspace::VoxelBox part_;
  workspace::BrickMemory& memory_;
  BandedDistance distance_;
  BrickBlock block_;
};

void add_interior(Plan& plan, std::vector<workspace::ObjectBricks::Part>& parts) {
  workspace::BrickKey key;
  for (key.z = plan.min.z; key.z < plan.min.z + plan.size[2]; ++key.z) {
    for (key.y = plan.min.y; key.y < plan.min.y + plan.size[1]; ++key.y) {
      for (key.x = plan.min.x; key.x < plan.min.x + plan.size[0]; ++key.x) {
        if (plan.at(key) == Need::kInterior) parts.push_back({key, nullptr});
      }
    }
  }
}

}  // namespace

workspace::ObjectBricks distance_bricks(const voxelise::SolidVoxels& solid,
                                        const workspace::LayerProfile& profile,
                                        const workspace::VoxelBox& part,
                                        const workspace::WorkOptions& options) {
  if (solid.box.empty()) return {};
  const OrderSteps steps = steps_of(profile);
  const BlockShape shape = shape_for(steps.reach);
  const SolidRows rows(solid, options.threads);
  Plan plan = plan_for(rows.cells(), steps.reach, part, solid.box);
  const std::vector<Task> tasks = tasks_of(plan, shape);
  workspace::BrickMemory memory(
      static_cast<std::size_t>(std::count(plan.need.begin(), plan.need.end(), Need::kOrders)));
  std::vector<Worker> workers;
  for (int i = 0; i < std::max(1, options.threads); ++i) workers.emplace_back(rows, steps, part, memory);
  std::atomic<bool> stopped = false;
  core::parallel_for(options.threads, tasks.size(), [&](std::size_t i, std::size_t worker) {
    if (stopped) return;
    if (worker == 0 && options.go_on &&
        !options.go_on(static_cast<double>(i) / static_cast<double>(tasks.size())))
      stopped = true;
    workers[worker].run(tasks[i], plan);
  });
  if (stopped) return {};
  std::vector<workspace::ObjectBricks::Part> parts;
  for (Worker& worker : workers)
    std::move(worker.parts.begin(), worker.parts.end(), std::back_inserter(parts));
  add_interior(plan, parts);
  return workspace::ObjectBricks(std::move(parts));
}

}  // namespace phantom::layers

#include "common/layers/layers.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <iterator>
#include <variant>

#include "common/layers/banded_distance.hpp"
#include "common/layers/stretched_distance.hpp"
#include "common/workspace/workspace.hpp"

namespace phantom::layers {
namespace {

using detail::BandedDistance;
using detail::BrickBlock;
using detail::Cells;
using detail::OrderSteps;
using detail::SolidRows;
using detail::StretchedDistance;

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
  workspace::VoxelBox box;
  std::vector<Need> need;  // by box.index()

  Need& at(workspace::Index3 key) { return need[box.index(key)]; }
};

/// The smallest box of voxels, in addresses of the grid, that holds a cell's solid.
workspace::VoxelBox solid_bounds(workspace::Index3 cell, const Cells::Bits& bits) {
  const workspace::Index3 corner = workspace::corner_of({cell});
  return workspace::VoxelBox::between(
      corner +
          workspace::Index3{std::countr_zero(bits.x), std::countr_zero(bits.y), std::countr_zero(bits.z)},
      corner + workspace::Index3{32 - std::countl_zero(bits.x), 32 - std::countl_zero(bits.y),
                                 32 - std::countl_zero(bits.z)});
}

/// Returns the square of the distance between the nearest voxels of two boxes.
std::int64_t square_between(const workspace::VoxelBox& a, const workspace::VoxelBox& b) {
  const workspace::Index3 one{1, 1, 1};
  const workspace::Index3 away =
      workspace::max({}, workspace::max(a.min - (b.end() - one), b.min - (a.end() - one)));
  return std::int64_t{away.x} * away.x + std::int64_t{away.y} * away.y + std::int64_t{away.z} * away.z;
}

Plan plan_for(const Cells& cells, int reach, const workspace::VoxelBox& part,
              const workspace::VoxelBox& solid_box) {
  Plan plan;
  const workspace::VoxelBox reached = solid_box.grown(reach).intersection(part);
  if (reached.empty()) return plan;
  plan.box = workspace::bricks_of(reached);
  plan.need.resize(plan.box.voxel_count());
  cells.box.for_each([&](workspace::Index3 cell) {
    const Cells::Bits& bits = cells.bits[cells.box.index(cell)];
    if (bits.x == 0) return;
    const workspace::VoxelBox bounds = solid_bounds(cell, bits);
    workspace::bricks_of(bounds.grown(reach)).intersection(plan.box).for_each([&](workspace::Index3 key) {
      Need& need = plan.at(key);
      if (need == Need::kNothing &&
          square_between(bounds, workspace::box_of({key})) <= std::int64_t{reach} * reach)
        need = Need::kOrders;
    });
    if (bits.interior && plan.box.contains(cell)) plan.at(cell) = Need::kInterior;
  });
  return plan;
}

/// Number of bricks that are computed together. They share their surroundings, so a longer reach calls for
/// more.
struct BlockShape {
  std::int32_t along_x, across;
};
BlockShape shape_for(int reach) {
  constexpr auto kAlong = static_cast<std::int32_t>(detail::kMaxBricksAlongX);
  return {kAlong, reach <= 32 ? 1 : reach <= 96 ? 2 : 4};
}

/// Blocks of one thread, in sequence along y. Each reuses some results of the previous one.
struct Task {
  workspace::BrickKey min;
  std::int32_t nx, ny, nz;           // bricks of a block
  std::vector<std::int32_t> blocks;  // along y, rising: only those with bricks that need orders
};

/// Returns the blocks of bricks in a column of the plan along y; the task may have none.
Task task_of(Plan& plan, const workspace::VoxelBox& column, std::int32_t across) {
  Task task{{column.min}, 0, across, column.size[2], {}};
  std::int32_t first_x = column.end().x, last_x = column.min.x - 1;
  for (std::int32_t y = column.min.y; y < column.end().y; ++y) {
    workspace::VoxelBox{{column.min.x, y, column.min.z}, {column.size[0], 1, column.size[2]}}.for_each(
        [&](workspace::Index3 key) {
          if (plan.at(key) != Need::kOrders) return;
          first_x = std::min(first_x, key.x);
          last_x = std::max(last_x, key.x);
          const std::int32_t block = (y - column.min.y) / across;
          if (task.blocks.empty() || task.blocks.back() != block) task.blocks.push_back(block);
        });
  }
  task.min.x = first_x;
  task.nx = last_x - first_x + 1;
  return task;
}

std::vector<Task> tasks_of(Plan& plan, BlockShape shape) {
  std::vector<Task> tasks;
  workspace::Index3 at = plan.box.min;
  for (; at.z < plan.box.end().z; at.z += shape.across) {
    for (at.x = plan.box.min.x; at.x < plan.box.end().x; at.x += shape.along_x) {
      const workspace::VoxelBox column{at, {shape.along_x, plan.box.size[1], shape.across}};
      Task task = task_of(plan, column.intersection(plan.box), shape.across);
      if (!task.blocks.empty()) tasks.push_back(std::move(task));
    }
  }
  return tasks;
}

/// Makes the voxels of the last bricks that lie beyond the grid free.
void cut_off(const workspace::VoxelBox& part, workspace::BrickKey key, std::int8_t* orders) {
  const workspace::VoxelBox brick = workspace::box_of(key);
  if (part.contains(brick)) return;
  brick.for_each([&](workspace::Index3 v) {
    if (!part.contains(v)) orders[workspace::brick_offset(v)] = workspace::kOrderFree;
  });
}

bool all_free(const std::int8_t* orders) {
  static const std::array<std::int8_t, workspace::kBrickVoxels> kFree{};
  return std::memcmp(orders, kFree.data(), workspace::kBrickVoxels) == 0;
}

/// One thread's share of the work.
class Worker {
 public:
  using Distance = std::variant<BandedDistance, StretchedDistance>;

  Worker(Distance distance, const workspace::VoxelBox& part, workspace::BrickMemory& memory)
      : part_(part), memory_(memory), distance_(std::move(distance)) {}

  void run(const Task& task, Plan& plan) {
    for (const std::int32_t block : task.blocks) run_block(task, task.min.y + block * task.ny, plan);
  }

  std::vector<workspace::ObjectBricks::Part> parts;

 private:
  void run_block(const Task& task, std::int32_t from_y, Plan& plan) {
    const workspace::VoxelBox bricks{{task.min.x, from_y, task.min.z}, {task.nx, task.ny, task.nz}};
    block_ = {workspace::corner_of({bricks.min}), task.nx, task.ny, task.nz, {}};
    std::vector<workspace::ObjectBricks::Part> made;
    bricks.for_each([&](workspace::Index3 key) {
      const bool needed = plan.box.contains(key) && plan.at(key) == Need::kOrders;
      if (needed) made.push_back({{key}, memory_.take()});
      block_.bricks.push_back(needed ? made.back().orders.get() : nullptr);
    });
    std::visit([&](auto& distance) { distance.run(block_); }, distance_);
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
  Distance distance_;
  BrickBlock block_;
};

}  // namespace

workspace::ObjectBricks distance_bricks(const voxelise::SolidVoxels& solid,
                                        const workspace::LayerProfile& profile,
                                        const workspace::VoxelBox& part,
                                        const workspace::WorkOptions& options,
                                        const Eigen::Vector3d& stretch) {
  if (solid.box.empty()) return {};
  const OrderSteps steps = steps_of(profile);
  const BlockShape shape = shape_for(steps.reach);
  const SolidRows rows(solid, options.threads);
  // The plan takes voxels for cubes of the shortest side. Others are farther away, never nearer.
  Plan plan = plan_for(rows.cells(), steps.reach, part, solid.box);
  const std::vector<Task> tasks = tasks_of(plan, shape);
  workspace::BrickMemory memory(
      static_cast<std::size_t>(std::count(plan.need.begin(), plan.need.end(), Need::kOrders)));
  std::vector<Worker> workers;
  for (int i = 0; i < std::max(1, options.threads); ++i) {
    if (stretch == Eigen::Vector3d::Ones())
      workers.emplace_back(BandedDistance(rows, steps), part, memory);
    else
      workers.emplace_back(StretchedDistance(solid, steps, stretch), part, memory);
  }
  const bool whole = workspace::parallel_for(
      options, tasks.size(), [&](std::size_t i, std::size_t worker) { workers[worker].run(tasks[i], plan); });
  if (!whole) return {};
  std::vector<workspace::ObjectBricks::Part> parts;
  for (Worker& worker : workers)
    std::move(worker.parts.begin(), worker.parts.end(), std::back_inserter(parts));
  plan.box.for_each([&](workspace::Index3 key) {
    if (plan.at(key) == Need::kInterior) parts.push_back({{key}, nullptr});
  });
  return workspace::ObjectBricks(std::move(parts));
}

}  // namespace phantom::layers

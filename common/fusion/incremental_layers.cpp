#include "common/fusion/incremental_layers.hpp"

#include <algorithm>
#include <cstring>
#include <utility>

#include "common/fusion/fused_block.hpp"
#include "common/layers/layers.hpp"

namespace phantom::fusion {
namespace {

using workspace::BrickKey;
using workspace::Index3;
using workspace::VoxelBox;

/// Returns the part of an occupancy in a box, from a word's border on, as the boundary of a solid.
voxelise::SolidVoxels solid_in(const workspace::BitVolume& occupied, const VoxelBox& box) {
  voxelise::SolidVoxels solid;
  if (box.empty()) return solid;
  const std::int32_t first = box.min.x & ~63;
  solid.box = {{first, box.min.y, box.min.z}, {box.end().x - first, box.size[1], box.size[2]}};
  solid.boundary = workspace::BitVolume::unwritten(solid.box.size);
  solid.inside = workspace::BitVolume(solid.box.size);
  const std::size_t words = solid.boundary.words_per_row();
  // Bits past the box, within its last word.
  const std::uint64_t last = ~std::uint64_t{0} >> (63 - ((solid.box.size[0] - 1) & 63));
  for (std::int32_t z = 0; z < solid.box.size[2]; ++z) {
    for (std::int32_t y = 0; y < solid.box.size[1]; ++y) {
      std::uint64_t* const to = solid.boundary.row(y, z);
      std::memcpy(to, occupied.row(box.min.y + y, box.min.z + z) + (first >> 6), words * sizeof *to);
      to[words - 1] &= last;
    }
  }
  return solid;
}

std::int64_t square_between(const VoxelBox& a, const VoxelBox& b) {
  const Index3 one{1, 1, 1};
  const Index3 away = workspace::max({}, workspace::max(a.min - (b.end() - one), b.min - (a.end() - one)));
  return std::int64_t{away.x} * away.x + std::int64_t{away.y} * away.y + std::int64_t{away.z} * away.z;
}

}  // namespace

workspace::ObjectBricks layers_of(const workspace::BitVolume& occupied, const workspace::GridSpec& grid,
                                  const workspace::LayerProfile& profile) {
  const VoxelBox whole = VoxelBox::of(grid);
  return layers::distance_bricks(solid_in(occupied, whole), profile, whole);
}

core::Expected<IncrementalLayers> IncrementalLayers::create(const workspace::GridSpec& grid,
                                                            const workspace::LayerProfile& profile) {
  if (core::Status checked = workspace::check_profile(profile); !checked) return checked;
  if (core::Status checked = workspace::check_voxel_size(grid.voxel_size_m); !checked) return checked;
  if (profile.method != workspace::LayerMethod::kDistance || !profile.inside_thickness_vox.empty())
    return core::Status::invalid_argument(
        "layers of live matter: a profile of another method, or with layers inside; allowed: method distance, "
        "layers outside");
  if (!grid.voxel_size_m.is_cube())
    return core::Status::invalid_argument(
        "layers of live matter: the voxels are no cubes; allowed: one size along x, y and z");
  return IncrementalLayers(grid, profile);
}

IncrementalLayers::IncrementalLayers(const workspace::GridSpec& grid, const workspace::LayerProfile& profile)
    : grid_(grid), profile_(profile), bricks_(workspace::bricks_of(VoxelBox::of(grid))) {
  orders_.resize(bricks_.voxel_count());
  affected_.resize(orders_.size());
}

/// Marks the bricks within reach of the changed blocks.
void IncrementalLayers::find_affected(std::span<const Index3> changed_blocks) {
  std::vector<std::pair<std::size_t, VoxelBox>> boxes;  // what changed in each brick
  for (const Index3 block : changed_blocks) {
    const VoxelBox voxels = voxels_of(block);
    boxes.emplace_back(bricks_.index(workspace::brick_of(voxels.min)), voxels);
  }
  std::sort(boxes.begin(), boxes.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  changes_.clear();
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    if (i > 0 && boxes[i].first == boxes[i - 1].first)
      changes_.back() = changes_.back().hull(boxes[i].second);
    else
      changes_.push_back(boxes[i].second);
  }
  const std::int32_t reach = profile_.reach_vox();
  for (const VoxelBox& change : changes_) {
    workspace::bricks_of(change.grown(reach)).intersection(bricks_).for_each([&](Index3 key) {
      if (square_between(change, workspace::box_of({key})) <= std::int64_t{reach} * reach)
        affected_[bricks_.index(key)] = 1;
    });
  }
}

/// Returns the largest box of affected bricks that begins at one of them and grows along x, y and then z, and
/// unmarks its bricks.
VoxelBox IncrementalLayers::next_box(Index3 first) {
  VoxelBox box{first, {1, 1, 1}};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    while (true) {
      VoxelBox more = box;
      more.min[axis] += box.size[axis];
      more.size[axis] = 1;
      bool all = bricks_.contains(more);
      if (all) more.for_each([&](Index3 key) { all = all && affected_[bricks_.index(key)] != 0; });
      if (!all) break;
      ++box.size[axis];
    }
  }
  box.for_each([&](Index3 key) { affected_[bricks_.index(key)] = 0; });
  return box;
}

void IncrementalLayers::replace(BrickKey key, std::shared_ptr<std::int8_t[]> orders) {
  std::shared_ptr<std::int8_t[]>& present = orders_[bricks_.index(key)];
  if (orders == nullptr && present == nullptr) return;
  if (orders != nullptr && present != nullptr &&
      std::memcmp(orders.get(), present.get(), workspace::kBrickVoxels) == 0)
    return;
  (orders == nullptr ? change_.removed : change_.changed).push_back(key);
  present = std::move(orders);
}

void IncrementalLayers::compute(const workspace::BitVolume& occupied, const VoxelBox& bricks) {
  const VoxelBox grid = VoxelBox::of(grid_);
  const VoxelBox part =
      VoxelBox::between(workspace::corner_of({bricks.min}), workspace::corner_of({bricks.end()}))
          .intersection(grid);
  const workspace::ObjectBricks made = layers::distance_bricks(
      solid_in(occupied, part.grown(profile_.reach_vox()).intersection(grid)), profile_, part);
  bricks.for_each([&](Index3 key) { replace({key}, made.share({key})); });
  change_.computed += bricks.voxel_count();
}

const LayersChange& IncrementalLayers::update(const workspace::BitVolume& occupied,
                                              std::span<const Index3> changed_blocks) {
  change_ = {};
  find_affected(changed_blocks);
  bricks_.for_each([&](Index3 key) {
    if (affected_[bricks_.index(key)] != 0) compute(occupied, next_box(key));
  });
  std::sort(change_.changed.begin(), change_.changed.end());
  std::sort(change_.removed.begin(), change_.removed.end());
  return change_;
}

workspace::ObjectBricks IncrementalLayers::bricks() const {
  std::vector<workspace::ObjectBricks::Part> parts;
  bricks_.for_each([&](Index3 key) {
    if (const auto& orders = orders_[bricks_.index(key)]) parts.push_back({{key}, orders});
  });
  return workspace::ObjectBricks(std::move(parts));
}

}  // namespace phantom::fusion

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <functional>

#include "common/core/parallel.hpp"
#include "common/layers/brick_painter.hpp"
#include "common/layers/grown_slices.hpp"
#include "common/layers/layers.hpp"

namespace phantom::layers {
namespace {

constexpr std::int32_t kWord = 64, kTile = 4;

/// Returns the greatest squared radius of an element's cells. For (m + ½)² = m² + m + ¼, integers only need
/// m² + m.
long long greatest_square(workspace::ShapingElement element, int m) {
  return element == workspace::ShapingElement::kSphere ? static_cast<long long>(m) * m
                                                       : static_cast<long long>(m) * m + m;
}

/// Returns the end of the tile that holds `at`, but at most `end`; all are in a box whose corner is at `min`.
constexpr std::int32_t end_of_tile(std::int32_t at, std::int32_t min, std::int32_t end) {
  return std::min(end, ((at + min) | (kTile - 1)) + 1 - min);
}

/// Returns the box of everything from which the layers within `part` grow, for layers that reach up to
/// `reach`. It holds the solid within reach, and between the solid and the part the layers that others grow
/// from. Layers beyond both along an axis are not needed. A voxel that grows from one of them also grows from
/// its neighbour towards the solid, because an element that contains a cell also contains all cells nearer to
/// its middle along an axis.
workspace::VoxelBox needed_box(const workspace::VoxelBox& solid, const workspace::VoxelBox& part, int reach) {
  const workspace::VoxelBox laid = solid.grown(reach).intersection(part);
  return laid.empty() ? workspace::VoxelBox{} : laid.hull(solid.intersection(part.grown(reach)));
}

/// Returns the box in which layers are laid: whole words along x, and along z whole layers of bricks, which
/// the threads share.
workspace::VoxelBox work_box(const workspace::VoxelBox& reached) {
  workspace::VoxelBox box = reached;
  box.min.x = reached.min.x & ~(kWord - 1);
  box.size[0] = (reached.min.x + reached.size[0] - box.min.x + kWord - 1) / kWord * kWord;
  return box;
}

/// Returns the box with its lower corner moved to a brick's corner, as that of `part` is.
workspace::VoxelBox whole_bricks(const workspace::VoxelBox& box, const workspace::VoxelBox& part) {
  return workspace::VoxelBox::between(workspace::corner_of(workspace::brick_of(box.min)), box.end())
      .intersection(part);
}

/// Grows a body outwards, layer by layer, in rows of bits.
class Growth {
 public:
  Growth(const voxelise::SolidVoxels& solid, const workspace::VoxelBox& box, const workspace::VoxelBox& part,
         int threads)
      : box_(box), threads_(threads), painter_(part), filled_(box.size), next_(box.size) {
    for (std::int32_t z = 0; z < box.size[2];) {
      const std::int32_t until =
          std::min(box.size[2], workspace::brick_along(z + box.min.z) * workspace::kBrickEdge +
                                    workspace::kBrickEdge - box.min.z);
      slabs_.push_back({z, until});
      z = until;
    }
    workspace::BitVolume boundary(box.size);
    take(solid.boundary, solid.box, boundary);
    take(solid.inside, solid.box, filled_);
    paint_solid(boundary);
    std::transform(filled_.words().begin(), filled_.words().end(), boundary.words().begin(),
                   filled_.words().begin(), std::bit_or<>());
    front_ = detail::MarkedBits(std::move(boundary));
  }

  /// Grows the next layer: the free voxels in the element centred on every voxel of the front.
  void grow(const detail::Element& element, std::int8_t order) {
    for_slabs([&](const Slab& slab) { grow(element, slab, order); });
    std::swap(front_, next_);
  }
  /// Makes the whole solid the front.
  void start_from_solid() { front_ = detail::MarkedBits(filled_); }
  workspace::ObjectBricks finish() { return painter_.finish(); }

 private:
  struct Slab {
    std::int32_t from_z, to_z;  // relative to the box
  };
  template <class Work>
  void for_slabs(const Work& work) {
    core::parallel_for(threads_, slabs_.size(), [&](std::size_t i, std::size_t) { work(slabs_[i]); });
  }
  void take(const workspace::BitVolume& bits, const workspace::VoxelBox& from,
            workspace::BitVolume& to) const;
  void paint_solid(const workspace::BitVolume& boundary);
  void paint_solid(const workspace::BitVolume& boundary, const Slab& slab, std::int32_t from_y,
                   std::int32_t to_y);
  void grow(const detail::Element& element, const Slab& slab, std::int8_t order);
  void finish_slices(const detail::GrownSlices& grown, std::int32_t from_z, std::int32_t to_z,
                     std::int8_t order);
  void finish_tiles(const detail::GrownSlices& grown, std::int32_t from_y, std::int32_t to_y,
                    std::int32_t from_z, std::int32_t to_z, std::int8_t order);
  void paint_tiles(const workspace::BitVolume& bits, std::size_t word, std::int32_t from_y, std::int32_t to_y,
                   std::int32_t from_z, std::int32_t to_z, std::int8_t order, std::uint64_t wanted = ~0ULL);

  workspace::VoxelBox box_;
  int threads_;
  detail::BrickPainter painter_;
  workspace::BitVolume filled_;
  detail::MarkedBits next_, front_{{0, 0, 0}};
  std::vector<Slab> slabs_;
};

/// Copies the part of a volume of bits that lies in the box.
void Growth::take(const workspace::BitVolume& bits, const workspace::VoxelBox& from,
                  workspace::BitVolume& to) const {
  const std::int32_t dx = from.min.x - box_.min.x;
  const auto words = static_cast<std::ptrdiff_t>(to.words_per_row());
  for (std::int32_t z = 0; z < from.size[2]; ++z) {
    for (std::int32_t y = 0; y < from.size[1]; ++y) {
      const std::int32_t to_y = y + from.min.y - box_.min.y, to_z = z + from.min.z - box_.min.z;
      if (to_y < 0 || to_z < 0 || to_y >= box_.size[1] || to_z >= box_.size[2]) continue;
      const std::uint64_t* row = bits.row(y, z);
      std::uint64_t* target = to.row(to_y, to_z);
      for (std::size_t i = 0; i < bits.words_per_row(); ++i) {
        if (row[i] == 0) continue;
        const std::int32_t x = dx + static_cast<std::int32_t>(i) * kWord;
        const std::ptrdiff_t at = x >> 6;
        const int shift = x & 63;
        if (at >= 0 && at < words) target[at] |= row[i] << shift;
        if (shift > 0 && at + 1 >= 0 && at + 1 < words) target[at + 1] |= row[i] >> (kWord - shift);
      }
    }
  }
}

/// Paints boundary and interior (everything else in filled_) into the bricks.
void Growth::paint_solid(const workspace::BitVolume& boundary) {
  for_slabs([&](const Slab& slab) {
    for (std::int32_t y = 0; y < box_.size[1];) {
      const std::int32_t to_y =
          std::min(box_.size[1], workspace::brick_along(y + box_.min.y) * workspace::kBrickEdge +
                                     workspace::kBrickEdge - box_.min.y);
      paint_solid(boundary, slab, y, to_y);
      y = to_y;
    }
  });
}

/// The same for a row of bricks. Bricks wholly in the interior are not painted voxel by voxel.
void Growth::paint_solid(const workspace::BitVolume& boundary, const Slab& slab, std::int32_t from_y,
                         std::int32_t to_y) {
  const bool all_rows =
      slab.to_z - slab.from_z == workspace::kBrickEdge && to_y - from_y == workspace::kBrickEdge;
  for (std::size_t i = 0; i < filled_.words_per_row(); ++i) {
    std::uint64_t throughout = all_rows ? ~std::uint64_t{0} : 0;
    for (std::int32_t z = slab.from_z; throughout != 0 && z < slab.to_z; ++z) {
      for (std::int32_t y = from_y; throughout != 0 && y < to_y; ++y)
        throughout &= filled_.row(y, z)[i] & ~boundary.row(y, z)[i];
    }
    const std::int32_t x = box_.min.x + static_cast<std::int32_t>(i) * kWord;
    std::uint64_t painted = 0;
    for (const std::int32_t half : {0, workspace::kBrickEdge}) {
      const std::uint64_t brick = std::uint64_t{0xFFFFFFFF} << half;
      const workspace::BrickKey key{workspace::brick_along(x + half),
                                    workspace::brick_along(from_y + box_.min.y),
                                    workspace::brick_along(slab.from_z + box_.min.z)};
      if ((throughout & brick) == brick && painter_.fill_interior(key)) painted |= brick;
    }
    for (std::int32_t z = slab.from_z; z < slab.to_z; z = end_of_tile(z, box_.min.z, slab.to_z)) {
      const std::int32_t to_z = end_of_tile(z, box_.min.z, slab.to_z);
      for (std::int32_t y = from_y; y < to_y; y = end_of_tile(y, box_.min.y, to_y)) {
        const std::int32_t tile_y = end_of_tile(y, box_.min.y, to_y);
        paint_tiles(filled_, i, y, tile_y, z, to_z, workspace::kOrderInterior, ~painted);
        paint_tiles(boundary, i, y, tile_y, z, to_z, workspace::kOrderBoundary);
      }
    }
  }
}

/// Gives an order to the voxels of a word that are set and wanted, in the rows [from_y, to_y) × [from_z,
/// to_z) of one layer of tiles.
void Growth::paint_tiles(const workspace::BitVolume& bits, std::size_t word, std::int32_t from_y,
                         std::int32_t to_y, std::int32_t from_z, std::int32_t to_z, std::int8_t order,
                         std::uint64_t wanted) {
  detail::TileRows rows{};
  std::uint64_t any = 0;
  for (std::int32_t z = from_z; z < to_z; ++z) {
    for (std::int32_t y = from_y; y < to_y; ++y) {
      const std::uint64_t here = bits.row(y, z)[word] & wanted;
      rows[static_cast<std::size_t>(4 * ((z + box_.min.z) & 3) + ((y + box_.min.y) & 3))] = here;
      any |= here;
    }
  }
  if (any == 0) return;
  painter_.paint(box_.min.x + static_cast<std::int32_t>(word) * kWord, (from_y + box_.min.y) & ~3,
                 (from_z + box_.min.z) & ~3, rows, order);
}

void Growth::grow(const detail::Element& element, const Slab& slab, std::int8_t order) {
  const std::int32_t m = element.m;
  detail::WidenedSlice slice(element, box_.size[1], filled_.words_per_row());
  detail::GrownSlices grown(m, kTile - 1, box_.size[1], filled_.words_per_row());
  std::int32_t z = std::max(0, slab.from_z - m);
  for (std::int32_t from = slab.from_z; from < slab.to_z;) {
    const std::int32_t to = end_of_tile(from, box_.min.z, slab.to_z);
    for (; z < std::min(box_.size[2], to + m); ++z) {
      if (slice.load(front_, z)) grown.add(slice, z, slab.from_z, slab.to_z);
    }
    finish_slices(grown, from, to, order);
    for (; from < to; ++from) grown.clear(from);
  }
}

/// Makes the new voxels of grown slices, of one layer of tiles, the next front.
void Growth::finish_slices(const detail::GrownSlices& grown, std::int32_t from_z, std::int32_t to_z,
                           std::int8_t order) {
  for (std::int32_t y = 0; y < box_.size[1]; y = end_of_tile(y, box_.min.y, box_.size[1]))
    finish_tiles(grown, y, end_of_tile(y, box_.min.y, box_.size[1]), from_z, to_z, order);
}

void Growth::finish_tiles(const detail::GrownSlices& grown, std::int32_t from_y, std::int32_t to_y,
                          std::int32_t from_z, std::int32_t to_z, std::int8_t order) {
  const std::size_t words = filled_.words_per_row();
  bool any_reached = false;
  for (std::int32_t z = from_z; z < to_z; ++z) {
    for (std::int32_t y = from_y; y < to_y; ++y) {
      const std::uint64_t* const reached = grown.row(y, z);
      std::uint64_t *filled = filled_.row(y, z), *next = next_.row(y, z);
      std::uint64_t any = 0;
      if (reached == nullptr) {
        if (next_.any(y, z) != 0) std::fill_n(next, words, 0);
      } else {
        for (std::size_t i = 0; i < words; ++i) {
          next[i] = reached[i] & ~filled[i];
          filled[i] |= next[i];
          any |= next[i];
        }
      }
      next_.any(y, z) = any != 0 ? 1 : 0;
      any_reached |= any != 0;
    }
  }
  if (!any_reached) return;
  for (std::size_t i = 0; i < words; ++i) paint_tiles(next_.bits(), i, from_y, to_y, from_z, to_z, order);
}

}  // namespace

bool in_element(workspace::ShapingElement element, int m, int i, int j, int k) {
  if (std::max({std::abs(i), std::abs(j), std::abs(k)}) > m) return false;
  const auto square = [](long long v) { return v * v; };
  return element == workspace::ShapingElement::kCube ||
         square(i) + square(j) + square(k) <= greatest_square(element, m);
}

std::uint64_t element_rows(workspace::ShapingElement element, int m) {
  std::uint64_t rows = 0;
  int dy = m;
  for (int dz = 0; dz <= m; ++dz) {
    while (!in_element(element, m, 0, dy, dz)) --dy;
    rows += static_cast<std::uint64_t>(2 * dy + 1) * (dz == 0 ? 1 : 2);
  }
  return rows;
}

workspace::ObjectBricks dilation_bricks(const voxelise::SolidVoxels& solid,
                                        const workspace::LayerProfile& profile,
                                        const workspace::VoxelBox& part,
                                        const workspace::WorkOptions& options) {
  if (solid.box.empty()) return {};
  const workspace::VoxelBox reached = needed_box(solid.box, part, profile.reach_vox());
  if (reached.empty()) return {};
  Growth growth(solid, work_box(reached), whole_bricks(reached.intersection(part), part), options.threads);
  if (profile.guard_vox > 0) {
    growth.start_from_solid();
    growth.grow(detail::element_of(workspace::ShapingElement::kSphere, profile.guard_vox),
                workspace::kOrderGuard);
  }
  const std::size_t layers = profile.thickness_vox.size();
  for (std::size_t i = 0; i < layers; ++i) {
    if (options.go_on && !options.go_on(static_cast<double>(i) / static_cast<double>(layers))) return {};
    growth.grow(detail::element_of(profile.element, profile.thickness_vox[i]),
                static_cast<std::int8_t>(i + 1));
  }
  return growth.finish();
}

}  // namespace phantom::layers

#include "common/voxel/dilation.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "common/core/parallel.hpp"
#include "common/voxel/brick_painter.hpp"

namespace phantom::voxel {
namespace {

constexpr std::int32_t kWord = 64;

/// Square of the radius that an element's cells may have: (m + ½)² = m² + m + ¼, of which integers see m² + m.
long long greatest_square(ShapingElement element, int m) {
  return element == ShapingElement::kSphere ? static_cast<long long>(m) * m : static_cast<long long>(m) * m + m;
}

/// An element as rows along x: cells −half…half at (dy, dz).
struct ElementRow {
  int dy, dz, half;
};

std::vector<ElementRow> rows_of(ShapingElement element, int m) {
  std::vector<ElementRow> rows;
  for (int dz = -m; dz <= m; ++dz) {
    for (int dy = -m; dy <= m; ++dy) {
      int half = m;
      while (half >= 0 && !in_element(element, m, half, dy, dz)) --half;
      if (half >= 0) rows.push_back({dy, dz, half});
    }
  }
  return rows;
}

/// to |= row moved by `shift` voxels towards higher x (lower if negative); `to` and `row` are `words` long.
void or_shifted(const std::uint64_t* row, std::ptrdiff_t words, int shift, std::uint64_t* to) {
  const std::ptrdiff_t by = std::abs(shift) / kWord;
  const int bits = std::abs(shift) % kWord;
  if (shift >= 0) {
    for (std::ptrdiff_t i = words - 1; i >= by; --i) {
      const std::uint64_t carry = bits > 0 && i > by ? row[i - by - 1] >> (kWord - bits) : 0;
      to[i] |= row[i - by] << bits | carry;
    }
  } else {
    for (std::ptrdiff_t i = 0; i + by < words; ++i) {
      const std::uint64_t carry = bits > 0 && i + by + 1 < words ? row[i + by + 1] << (kWord - bits) : 0;
      to[i] |= row[i + by] >> bits | carry;
    }
  }
}

constexpr std::int32_t brick_of(std::int32_t voxel) { return voxel >> 5; }

/// The box in which layers are laid: whole words along x, whole layers of bricks along z for the threads to share.
VoxelBox work_box(const VoxelBox& reached) {
  VoxelBox box = reached;
  box.min.x = reached.min.x & ~(kWord - 1);
  box.size[0] = (reached.min.x + reached.size[0] - box.min.x + kWord - 1) / kWord * kWord;
  return box;
}

/// The box, its lower corner moved to a brick's (which part's is).
VoxelBox whole_bricks(const VoxelBox& box, const VoxelBox& part) {
  VoxelBox whole = box;
  whole.min = {brick_of(box.min.x) * kBrickEdge, brick_of(box.min.y) * kBrickEdge, brick_of(box.min.z) * kBrickEdge};
  whole.size = {box.min.x + box.size[0] - whole.min.x, box.min.y + box.size[1] - whole.min.y, box.min.z + box.size[2] - whole.min.z};
  return whole.intersection(part);
}

/// Grows a body outwards, layer by layer, in rows of bits.
class Growth {
 public:
  Growth(const SolidVoxels& solid, const VoxelBox& box, const VoxelBox& part, int threads)
      : box_(box), threads_(threads), painter_(part), filled_(box.size), front_(box.size), grown_(box.size) {
    for (std::int32_t z = 0; z < box.size[2];) {
      const std::int32_t until = std::min(box.size[2], brick_of(z + box.min.z) * kBrickEdge + kBrickEdge - box.min.z);
      slabs_.push_back({z, until});
      z = until;
    }
    take(solid.boundary, solid.box, front_);
    take(solid.interior, solid.box, filled_);
    paint_solid();
  }

  /// The next layer: what the element, centred on every voxel of the front, holds of free space.
  void grow(const std::vector<ElementRow>& element, std::int8_t order) {
    for_slabs([&](const Slab& slab) { spread(element, slab); });
    for_slabs([&](const Slab& slab) { settle(slab, order); });
  }
  /// The front becomes the whole solid.
  void start_from_solid() { front_ = filled_; }
  ObjectBricks finish() { return painter_.finish(); }

 private:
  struct Slab {
    std::int32_t from_z, to_z;  // in the box
  };
  template <class Work>
  void for_slabs(const Work& work) {
    core::parallel_for(threads_, slabs_.size(), [&](std::size_t i, std::size_t) { work(slabs_[i]); });
  }
  void take(const BitVolume& bits, const VoxelBox& from, BitVolume& to) const;
  void paint_solid();
  void paint_solid(const Slab& slab, std::int32_t from_y, std::int32_t to_y);
  void spread(const std::vector<ElementRow>& element, const Slab& slab);
  void spread_row(const std::vector<ElementRow>& element, const Slab& slab, std::int32_t y, std::int32_t z, int m,
                  std::vector<std::uint64_t>& widened);
  void settle(const Slab& slab, std::int8_t order);

  VoxelBox box_;
  int threads_;
  detail::BrickPainter painter_;
  BitVolume filled_, front_, grown_;
  std::vector<Slab> slabs_;
};

/// What the box holds of a volume of bits.
void Growth::take(const BitVolume& bits, const VoxelBox& from, BitVolume& to) const {
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

/// Boundary (in front_) and interior (in filled_) into the bricks; then filled_ is both.
void Growth::paint_solid() {
  for_slabs([&](const Slab& slab) {
    for (std::int32_t y = 0; y < box_.size[1];) {
      const std::int32_t to_y = std::min(box_.size[1], brick_of(y + box_.min.y) * kBrickEdge + kBrickEdge - box_.min.y);
      paint_solid(slab, y, to_y);
      y = to_y;
    }
  });
}

/// The same for a row of bricks. Bricks that are interior throughout are not painted voxel by voxel.
void Growth::paint_solid(const Slab& slab, std::int32_t from_y, std::int32_t to_y) {
  const bool all_rows = slab.to_z - slab.from_z == kBrickEdge && to_y - from_y == kBrickEdge;
  for (std::size_t i = 0; i < filled_.words_per_row(); ++i) {
    std::uint64_t throughout = all_rows ? ~std::uint64_t{0} : 0;
    for (std::int32_t z = slab.from_z; throughout != 0 && z < slab.to_z; ++z) {
      for (std::int32_t y = from_y; throughout != 0 && y < to_y; ++y) throughout &= filled_.row(y, z)[i];
    }
    const std::int32_t x = box_.min.x + static_cast<std::int32_t>(i) * kWord;
    std::uint64_t painted = 0;
    for (const std::int32_t half : {0, kBrickEdge}) {
      const std::uint64_t brick = std::uint64_t{0xFFFFFFFF} << half;
      const BrickKey key{brick_of(x + half), brick_of(from_y + box_.min.y), brick_of(slab.from_z + box_.min.z)};
      if ((throughout & brick) == brick && painter_.fill_interior(key)) painted |= brick;
    }
    for (std::int32_t z = slab.from_z; z < slab.to_z; ++z) {
      for (std::int32_t y = from_y; y < to_y; ++y) {
        const std::uint64_t boundary = front_.row(y, z)[i];
        std::uint64_t& filled = filled_.row(y, z)[i];
        painter_.paint(x, y + box_.min.y, z + box_.min.z, boundary, kOrderBoundary);
        painter_.paint(x, y + box_.min.y, z + box_.min.z, filled & ~painted, kOrderInterior);
        filled |= boundary;
      }
    }
  }
}

void Growth::spread(const std::vector<ElementRow>& element, const Slab& slab) {
  int m = 0;
  for (const ElementRow& row : element) m = std::max(m, row.half);
  std::vector<std::uint64_t> widened;
  const std::int32_t from = std::max(0, slab.from_z - m), to = std::min(box_.size[2], slab.to_z + m);
  for (std::int32_t z = from; z < to; ++z) {
    for (std::int32_t y = 0; y < box_.size[1]; ++y) spread_row(element, slab, y, z, m, widened);
  }
}

void Growth::spread_row(const std::vector<ElementRow>& element, const Slab& slab, std::int32_t y, std::int32_t z, int m,
                        std::vector<std::uint64_t>& widened) {
  const std::uint64_t* row = front_.row(y, z);
  const auto words = static_cast<std::ptrdiff_t>(front_.words_per_row());
  std::ptrdiff_t first = 0, last = words;
  while (first < last && row[first] == 0) ++first;
  if (first == last) return;
  while (row[last - 1] == 0) --last;
  const std::ptrdiff_t margin = (m + kWord - 1) / kWord;
  first = std::max<std::ptrdiff_t>(0, first - margin);
  last = std::min(words, last + margin);
  const std::ptrdiff_t width = last - first;
  // The row widened by 0…m voxels on both sides, each made from the one before.
  widened.resize(static_cast<std::size_t>(width * (m + 1)));
  std::copy(row + first, row + last, widened.begin());
  for (int half = 1; half <= m; ++half) {
    std::uint64_t* wider = widened.data() + half * width;
    std::copy(wider - width, wider, wider);
    or_shifted(row + first, width, half, wider);
    or_shifted(row + first, width, -half, wider);
  }
  for (const ElementRow& part : element) {
    const std::int32_t to_y = y + part.dy, to_z = z + part.dz;
    if (to_y < 0 || to_y >= box_.size[1] || to_z < slab.from_z || to_z >= slab.to_z) continue;
    const std::uint64_t* wide = widened.data() + part.half * width;
    std::uint64_t* to = grown_.row(to_y, to_z) + first;
    for (std::ptrdiff_t i = 0; i < width; ++i) to[i] |= wide[i];
  }
}

/// What is new in grown_ becomes the front.
void Growth::settle(const Slab& slab, std::int8_t order) {
  for (std::int32_t z = slab.from_z; z < slab.to_z; ++z) {
    for (std::int32_t y = 0; y < box_.size[1]; ++y) {
      std::uint64_t *filled = filled_.row(y, z), *front = front_.row(y, z), *grown = grown_.row(y, z);
      for (std::size_t i = 0; i < filled_.words_per_row(); ++i) {
        const std::uint64_t fresh = grown[i] & ~filled[i];
        front[i] = fresh;
        grown[i] = 0;
        if (fresh == 0) continue;
        filled[i] |= fresh;
        painter_.paint(box_.min.x + static_cast<std::int32_t>(i) * kWord, y + box_.min.y, z + box_.min.z, fresh, order);
      }
    }
  }
}

}  // namespace

bool in_element(ShapingElement element, int m, int i, int j, int k) {
  if (std::max({std::abs(i), std::abs(j), std::abs(k)}) > m) return false;
  const auto square = [](long long v) { return v * v; };
  return element == ShapingElement::kCube || square(i) + square(j) + square(k) <= greatest_square(element, m);
}

ObjectBricks dilation_bricks(const SolidVoxels& solid, const LayerProfile& profile, const VoxelBox& part,
                             const LayerOptions& options) {
  if (solid.box.empty()) return {};
  const int reach = profile.reach_vox();
  const VoxelBox reached = solid.box.grown(reach).intersection(part.grown(reach));
  if (reached.intersection(part).empty()) return {};
  Growth growth(solid, work_box(reached), whole_bricks(reached.intersection(part), part), options.threads);
  if (profile.guard_vox > 0) {
    growth.start_from_solid();
    growth.grow(rows_of(ShapingElement::kSphere, profile.guard_vox), kOrderGuard);
  }
  const std::size_t layers = profile.thickness_vox.size();
  for (std::size_t i = 0; i < layers; ++i) {
    if (options.go_on && !options.go_on(static_cast<double>(i) / static_cast<double>(layers))) return {};
    growth.grow(rows_of(profile.element, profile.thickness_vox[i]), static_cast<std::int8_t>(i + 1));
  }
  return growth.finish();
}

}  // namespace phantom::voxel

#include "common/voxel/dilation.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>

#include "common/core/parallel.hpp"
#include "common/voxel/brick_painter.hpp"

namespace phantom::voxel {
namespace {

constexpr std::int32_t kWord = 64;
constexpr std::ptrdiff_t kAtOnce = 8;  // words that are gathered together
using Words = std::array<std::uint64_t, static_cast<std::size_t>(kAtOnce)>;

/// Square of the radius that an element's cells may have: (m + ½)² = m² + m + ¼, of which integers see m² +
/// m.
long long greatest_square(ShapingElement element, int m) {
  return element == ShapingElement::kSphere ? static_cast<long long>(m) * m
                                            : static_cast<long long>(m) * m + m;
}

/// An element as rows along x: cells −half…half at dy, by |dz|. All elements are the same both ways along
/// each axis.
struct ElementRow {
  int dy, half;
};
struct Element {
  int m;
  std::vector<std::vector<ElementRow>> rows;  // index: |dz|, 0…m
};

Element element_of(ShapingElement shape, int m) {
  Element element{m, std::vector<std::vector<ElementRow>>(static_cast<std::size_t>(m) + 1)};
  for (int dz = 0; dz <= m; ++dz) {
    for (int dy = -m; dy <= m; ++dy) {
      int half = m;
      while (half >= 0 && !in_element(shape, m, half, dy, dz)) --half;
      if (half >= 0) element.rows[static_cast<std::size_t>(dz)].push_back({dy, half});
    }
  }
  return element;
}

/// Every row of a slice widened along x by 0…m voxels on both sides; only the words between the first and the
/// last that can hold anything, and only rows within m of one that does: nothing but 0 in those between.
class WidenedSlice {
 public:
  explicit WidenedSlice(const Element& element) : element_(element), offsets_(element.rows.size()) {}

  /// False if the slice is empty.
  bool load(const BitVolume& bits, std::int32_t z);

  std::ptrdiff_t first_word() const { return first_; }
  std::ptrdiff_t width() const { return width_; }
  /// Whether any row within m of y holds anything.
  bool near(std::int32_t y) const { return near_[place(y)] != 0; }
  /// What the element's rows at ±dz, centred on row y where near(y), hold of kAtOnce words from a word of
  /// width() on.
  Words gather(std::int32_t y, int dz, std::ptrdiff_t word) const {
    const std::uint64_t* const here =
        words_.data() + static_cast<std::ptrdiff_t>(place(y)) * (element_.m + 1) * stride_ + word;
    Words gathered{};
    for (const std::ptrdiff_t offset : offsets_[static_cast<std::size_t>(dz)]) {
      for (std::size_t i = 0; i < gathered.size(); ++i)
        gathered[i] |= here[offset + static_cast<std::ptrdiff_t>(i)];
    }
    return gathered;
  }

 private:
  std::size_t place(std::int32_t y) const { return static_cast<std::size_t>(y + 2 * element_.m); }
  void find_words(const BitVolume& bits, std::int32_t z);
  void find_near();

  const Element& element_;
  std::ptrdiff_t first_ = 0, width_ = 0, stride_ = 0;
  std::vector<std::uint8_t> any_, near_;              // per row, 2 m rows more before and behind
  std::vector<std::uint64_t> words_;                  // [row][half][word]
  std::vector<std::vector<std::ptrdiff_t>> offsets_;  // by |dz|: of the element's rows in words_
};

/// `to` becomes the row widened by one voxel on both sides.
void widen(const std::uint64_t* row, std::ptrdiff_t words, std::uint64_t* to) {
  if (words == 1) {
    to[0] = row[0] | row[0] << 1 | row[0] >> 1;
    return;
  }
  to[0] = row[0] | row[0] << 1 | row[0] >> 1 | row[1] << (kWord - 1);
  for (std::ptrdiff_t i = 1; i + 1 < words; ++i)
    to[i] = row[i] | row[i] << 1 | row[i] >> 1 | row[i - 1] >> (kWord - 1) | row[i + 1] << (kWord - 1);
  to[words - 1] = row[words - 1] | row[words - 1] << 1 | row[words - 1] >> 1 | row[words - 2] >> (kWord - 1);
}

void WidenedSlice::find_words(const BitVolume& bits, std::int32_t z) {
  const auto words = static_cast<std::ptrdiff_t>(bits.words_per_row());
  std::ptrdiff_t first = words, last = 0;
  any_.assign(place(bits.size()[1] + 2 * element_.m), 0);
  for (std::int32_t y = 0; y < bits.size()[1]; ++y) {
    const std::uint64_t* row = bits.row(y, z);
    for (std::ptrdiff_t i = 0; i < words; ++i) {
      if (row[i] == 0) continue;
      any_[place(y)] = 1;
      first = std::min(first, i);
      last = std::max(last, i + 1);
    }
  }
  const std::ptrdiff_t margin = (element_.m + kWord - 1) / kWord;
  first_ = std::max<std::ptrdiff_t>(0, first - margin);
  width_ = first < last ? std::min(words, last + margin) - first_ : 0;
}

void WidenedSlice::find_near() {
  const auto m = static_cast<std::size_t>(element_.m);
  near_.assign(any_.size(), 0);
  std::size_t count = 0;  // of rows that hold anything, within m of row i
  for (std::size_t i = 0; i < m; ++i) count += any_[i];
  for (std::size_t i = 0; i < any_.size(); ++i) {
    if (i + m < any_.size()) count += any_[i + m];
    near_[i] = count > 0 ? 1 : 0;
    if (i >= m) count -= any_[i - m];
  }
}

bool WidenedSlice::load(const BitVolume& bits, std::int32_t z) {
  find_words(bits, z);
  if (width_ == 0) return false;
  find_near();
  const std::int32_t m = element_.m;
  stride_ = (width_ + kAtOnce - 1) / kAtOnce * kAtOnce;
  const std::ptrdiff_t row_words = (m + 1) * stride_;
  words_.resize(any_.size() * static_cast<std::size_t>(row_words));
  for (std::size_t dz = 0; dz < offsets_.size(); ++dz) {
    offsets_[dz].clear();
    for (const ElementRow& row : element_.rows[dz])
      offsets_[dz].push_back(row.dy * row_words + row.half * stride_);
  }
  // Whether a row that is near one that holds anything looks at row i. Such rows come 2 m + 1 at a time, so
  // that three places tell of all within m.
  const auto asked = [&](std::size_t i) {
    const auto reach = static_cast<std::size_t>(m);
    return near_[i] != 0 || (i >= reach && near_[i - reach] != 0) ||
           (i + reach < near_.size() && near_[i + reach] != 0);
  };
  for (std::size_t i = 0; i < any_.size(); ++i) {
    std::uint64_t* const wide = words_.data() + static_cast<std::ptrdiff_t>(i) * row_words;
    if (any_[i] == 0) {
      if (asked(i)) std::fill(wide, wide + row_words, 0);
      continue;
    }
    const std::uint64_t* from = bits.row(static_cast<std::int32_t>(i) - 2 * m, z) + first_;
    std::copy(from, from + width_, wide);
    for (int half = 1; half <= m; ++half) widen(wide + (half - 1) * stride_, width_, wide + half * stride_);
    for (int half = 0; half <= m; ++half)
      std::fill(wide + half * stride_ + width_, wide + (half + 1) * stride_, 0);
  }
  return true;
}

constexpr std::int32_t brick_of(std::int32_t voxel) { return voxel >> 5; }

/// The box in which layers are laid: whole words along x, whole layers of bricks along z for the threads to
/// share.
VoxelBox work_box(const VoxelBox& reached) {
  VoxelBox box = reached;
  box.min.x = reached.min.x & ~(kWord - 1);
  box.size[0] = (reached.min.x + reached.size[0] - box.min.x + kWord - 1) / kWord * kWord;
  return box;
}

/// The box, its lower corner moved to a brick's (which part's is).
VoxelBox whole_bricks(const VoxelBox& box, const VoxelBox& part) {
  VoxelBox whole = box;
  whole.min = {brick_of(box.min.x) * kBrickEdge, brick_of(box.min.y) * kBrickEdge,
               brick_of(box.min.z) * kBrickEdge};
  whole.size = {box.min.x + box.size[0] - whole.min.x, box.min.y + box.size[1] - whole.min.y,
                box.min.z + box.size[2] - whole.min.z};
  return whole.intersection(part);
}

/// Grows a body outwards, layer by layer, in rows of bits.
class Growth {
 public:
  Growth(const SolidVoxels& solid, const VoxelBox& box, const VoxelBox& part, int threads)
      : box_(box), threads_(threads), painter_(part), filled_(box.size), front_(box.size), grown_(box.size) {
    for (std::int32_t z = 0; z < box.size[2];) {
      const std::int32_t until =
          std::min(box.size[2], brick_of(z + box.min.z) * kBrickEdge + kBrickEdge - box.min.z);
      slabs_.push_back({z, until});
      z = until;
    }
    take(solid.boundary, solid.box, front_);
    take(solid.interior, solid.box, filled_);
    paint_solid();
  }

  /// The next layer: what the element, centred on every voxel of the front, holds of free space.
  void grow(const Element& element, std::int8_t order) {
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
  void spread(const Element& element, const Slab& slab);
  void spread_to_row(const Element& element, const Slab& slab, const WidenedSlice& slice, std::int32_t y,
                     std::int32_t z);
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
      const std::int32_t to_y =
          std::min(box_.size[1], brick_of(y + box_.min.y) * kBrickEdge + kBrickEdge - box_.min.y);
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
      const BrickKey key{brick_of(x + half), brick_of(from_y + box_.min.y),
                         brick_of(slab.from_z + box_.min.z)};
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

void Growth::spread(const Element& element, const Slab& slab) {
  WidenedSlice slice(element);
  const std::int32_t from = std::max(0, slab.from_z - element.m),
                     to = std::min(box_.size[2], slab.to_z + element.m);
  for (std::int32_t z = from; z < to; ++z) {
    if (!slice.load(front_, z)) continue;
    for (std::int32_t y = 0; y < box_.size[1]; ++y) {
      if (slice.near(y)) spread_to_row(element, slab, slice, y, z);
    }
  }
}

/// What the element, centred on slice z, holds of the rows y of all slices.
void Growth::spread_to_row(const Element& element, const Slab& slab, const WidenedSlice& slice,
                           std::int32_t y, std::int32_t z) {
  for (int dz = 0; dz <= element.m; ++dz) {
    const std::int32_t above = z + dz, below = dz > 0 ? z - dz : -1;
    const auto in_slab = [&](std::int32_t to_z) { return to_z >= slab.from_z && to_z < slab.to_z; };
    if (!in_slab(above) && !in_slab(below)) continue;
    for (std::ptrdiff_t first = 0; first < slice.width(); first += kAtOnce) {
      const Words gathered = slice.gather(y, dz, first);
      const auto count = static_cast<std::size_t>(std::min(kAtOnce, slice.width() - first));
      for (const std::int32_t to_z : {above, below}) {
        if (!in_slab(to_z)) continue;
        std::uint64_t* to = grown_.row(y, to_z) + slice.first_word() + first;
        for (std::size_t i = 0; i < count; ++i) to[i] |= gathered[i];
      }
    }
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
        painter_.paint(box_.min.x + static_cast<std::int32_t>(i) * kWord, y + box_.min.y, z + box_.min.z,
                       fresh, order);
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
                             const WorkOptions& options) {
  if (solid.box.empty()) return {};
  const int reach = profile.reach_vox();
  const VoxelBox reached = solid.box.grown(reach).intersection(part.grown(reach));
  if (reached.intersection(part).empty()) return {};
  Growth growth(solid, work_box(reached), whole_bricks(reached.intersection(part), part), options.threads);
  if (profile.guard_vox > 0) {
    growth.start_from_solid();
    growth.grow(element_of(ShapingElement::kSphere, profile.guard_vox), kOrderGuard);
  }
  const std::size_t layers = profile.thickness_vox.size();
  for (std::size_t i = 0; i < layers; ++i) {
    if (options.go_on && !options.go_on(static_cast<double>(i) / static_cast<double>(layers))) return {};
    growth.grow(element_of(profile.element, profile.thickness_vox[i]), static_cast<std::int8_t>(i + 1));
  }
  return growth.finish();
}

}  // namespace phantom::voxel

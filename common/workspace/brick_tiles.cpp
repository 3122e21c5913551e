#include "common/workspace/brick_tiles.hpp"

#include <algorithm>
#include <bit>
#include <cstring>
#include <memory>
#include <string>

// Compiled once per instruction set; the best one that the processor supports is chosen at run time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "common/workspace/brick_tiles.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#ifndef PHANTOM_WORKSPACE_BRICK_TILES_TYPES
#define PHANTOM_WORKSPACE_BRICK_TILES_TYPES
namespace phantom::workspace::detail {

constexpr std::size_t kTileVoxels = 64, kTiles = kBrickVoxels / kTileVoxels;

/// Holds the brick's kinds, indexed by their number.
struct Kinds {
  std::size_t count = 0;
  std::array<std::uint8_t, 256> code;
  std::array<std::uint8_t, 256> order;  // int8
  std::array<std::uint16_t, 256> object;

  bool is(std::size_t kind, std::uint8_t a_code, std::uint8_t an_order, std::uint16_t an_object) const {
    return code[kind] == a_code && order[kind] == an_order && object[kind] == an_object;
  }
};

/// Holds the tiles' part of the form. The writer makes sure that nothing exceeds the arrays.
struct Tiles {
  std::array<std::uint8_t, kTiles> kinds;  // number of kinds of each tile
  std::array<std::uint8_t, kBrickVoxels> kind;
  std::array<std::uint64_t, kMaxTiledBytes / 8> mask;
  std::size_t all_kinds = 0, masks = 0;
};

/// Numbers kinds in the order in which they first occur. A table of guesses finds most of them at once.
class KindFinder {
 public:
  explicit KindFinder(Kinds& kinds) : kinds_(kinds) {}
  /// Returns the kind's number, or 256 if there are too many kinds.
  std::size_t find(std::uint8_t code, std::uint8_t order, std::uint16_t object) {
    std::uint8_t& guess = guesses_[(code * 31U + order * 7U + object * 113U) % guesses_.size()];
    if (guess < kinds_.count && kinds_.is(guess, code, order, object)) return guess;
    for (std::size_t kind = 0; kind < kinds_.count; ++kind) {
      if (kinds_.is(kind, code, order, object)) return guess = static_cast<std::uint8_t>(kind);
    }
    if (kinds_.count == 256) return 256;
    kinds_.code[kinds_.count] = code;
    kinds_.order[kinds_.count] = order;
    kinds_.object[kinds_.count] = object;
    guess = static_cast<std::uint8_t>(kinds_.count);
    return kinds_.count++;
  }

 private:
  Kinds& kinds_;
  std::array<std::uint8_t, 256> guesses_{};
};

}  // namespace phantom::workspace::detail
#endif

HWY_BEFORE_NAMESPACE();
namespace phantom::workspace::detail::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

constexpr hn::CappedTag<std::uint8_t, kTileVoxels> kBytes;
constexpr hn::CappedTag<std::uint16_t, kTileVoxels / 2> kWords;

/// Returns which voxels of a tile have this value, one bit each.
template <class Tag, class T>
HWY_INLINE std::uint64_t Equal(Tag tag, const T* tile, T value) {
  std::uint64_t equal = 0;
  for (std::size_t part = 0; part < kTileVoxels; part += hn::Lanes(tag)) {
    std::uint64_t bits = 0;
    hn::StoreMaskBits(tag, hn::Eq(hn::LoadU(tag, tile + part), hn::Set(tag, value)),
                      reinterpret_cast<std::uint8_t*>(&bits));
    equal |= bits << part;
  }
  return equal;
}

/// Finds the kinds and masks of all tiles. Returns false if there are too many kinds or masks. `objects`:
/// null if every voxel with a μ code belongs to `sole_object`, and no other voxel does.
bool FindTiles(const std::uint8_t* codes, const std::uint8_t* orders, const std::uint16_t* objects,
               std::uint16_t sole_object, Kinds& kinds, Tiles& tiles) {
  KindFinder finder(kinds);
  for (std::size_t tile = 0; tile < kTiles; ++tile) {
    const std::size_t at = tile * kTileVoxels;
    std::uint64_t left = ~std::uint64_t{0};
    std::uint8_t count = 0;
    for (; left != 0; ++count) {
      const std::size_t voxel = at + static_cast<std::size_t>(std::countr_zero(left));
      const std::uint8_t code = codes[voxel], order = orders[voxel];
      const std::uint16_t object = objects != nullptr ? objects[voxel] : code != 0 ? sole_object : 0;
      const std::size_t kind = finder.find(code, order, object);
      if (kind == 256 || tiles.masks == tiles.mask.size()) return false;
      std::uint64_t like = left & Equal(kBytes, codes + at, code) & Equal(kBytes, orders + at, order);
      if (objects != nullptr) like &= Equal(kWords, objects + at, object);
      tiles.kind[tiles.all_kinds++] = static_cast<std::uint8_t>(kind);
      if (count > 0) tiles.mask[tiles.masks++] = like;
      left &= ~like;
    }
    tiles.kinds[tile] = count;
  }
  return true;
}

/// Writes one tile's voxels from its `count` kinds and the masks of all kinds but the first.
template <class Tag, class T>
HWY_INLINE void Paint(Tag tag, const std::array<T, 256>& value, const std::uint8_t* kind, std::size_t count,
                      const std::uint64_t* mask, T* tile) {
  for (std::size_t part = 0; part < kTileVoxels; part += hn::Lanes(tag)) {
    auto painted = hn::Set(tag, value[kind[0]]);
    for (std::size_t i = 1; i < count; ++i) {
      const std::uint64_t bits = mask[i - 1] >> part;
      const auto here = hn::LoadMaskBits(tag, reinterpret_cast<const std::uint8_t*>(&bits));
      painted = hn::IfThenElse(here, hn::Set(tag, value[kind[i]]), painted);
    }
    hn::StoreU(painted, tag, tile + part);
  }
}

void PaintTiles(const Kinds& kinds, const Tiles& tiles, BrickData& brick) {
  const std::uint8_t* kind = tiles.kind.data();
  const std::uint64_t* mask = tiles.mask.data();
  for (std::size_t tile = 0; tile < kTiles; ++tile) {
    const std::size_t at = tile * kTileVoxels, count = tiles.kinds[tile];
    Paint(kBytes, kinds.code, kind, count, mask, brick.mu_code.data() + at);
    Paint(kBytes, kinds.order, kind, count, mask, reinterpret_cast<std::uint8_t*>(brick.order.data()) + at);
    Paint(kWords, kinds.object, kind, count, mask, brick.object.data() + at);
    kind += count;
    mask += count - 1;
  }
}

}  // namespace phantom::workspace::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace phantom::workspace {
namespace detail {

HWY_EXPORT(FindTiles);
HWY_EXPORT(PaintTiles);

namespace {

/// Kept per thread, as it is too large for a stack.
Tiles& scratch() {
  thread_local const auto tiles = std::make_unique<Tiles>();
  return *tiles;
}

core::Status refused(const char* why) {
  return core::Status::invalid_argument(std::string("brick: tiled form: ") + why);
}

/// Takes bytes from the front as long as there are enough.
class Source {
 public:
  explicit Source(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}
  bool take(void* to, std::size_t size) {
    if (size > bytes_.size()) return false;
    if (size > 0) std::memcpy(to, bytes_.data(), size);
    bytes_ = bytes_.subspan(size);
    return true;
  }
  bool empty() const { return bytes_.empty(); }

 private:
  std::span<const std::uint8_t> bytes_;
};

core::Status read(std::span<const std::uint8_t> bytes, Kinds& kinds, Tiles& tiles) {
  Source source(bytes);
  std::array<std::uint8_t, 2> head;
  if (!source.take(head.data(), 2) || head[0] != kTiledForm) return refused("is of an unknown form");
  kinds.count = std::size_t{head[1]} + 1;
  if (!source.take(kinds.code.data(), kinds.count) || !source.take(kinds.order.data(), kinds.count) ||
      !source.take(kinds.object.data(), 2 * kinds.count) || !source.take(tiles.kinds.data(), kTiles))
    return refused("is cut short");
  tiles.all_kinds = 0;
  for (const std::uint8_t count : tiles.kinds) {
    if (count < 1 || count > kTileVoxels) return refused("a tile has no kind of voxel, or more than 64");
    tiles.all_kinds += count;
  }
  tiles.masks = tiles.all_kinds - kTiles;
  if (tiles.masks > tiles.mask.size()) return refused("has more kinds than its length allows");
  if (!source.take(tiles.kind.data(), tiles.all_kinds) || !source.take(tiles.mask.data(), 8 * tiles.masks))
    return refused("is cut short");
  return source.empty() ? core::Status::ok() : refused("has bytes too many");
}

/// Returns whether every kind occurs, and whether in every tile each kind that it names occurs.
bool all_occur(const Kinds& kinds, const Tiles& tiles) {
  std::array<bool, 256> occurs{};
  const std::uint64_t* mask = tiles.mask.data();
  for (const std::uint8_t count : tiles.kinds) {
    std::uint64_t taken = 0;
    for (const std::uint64_t* end = mask + (count - 1); mask != end; ++mask) {
      if (*mask == 0 || (taken & *mask) != 0) return false;
      taken |= *mask;
    }
    if (taken == ~std::uint64_t{0}) return false;
  }
  for (std::size_t i = 0; i < tiles.all_kinds; ++i) occurs[tiles.kind[i]] = true;
  const auto end_of_kinds = occurs.begin() + static_cast<std::ptrdiff_t>(kinds.count);
  return std::find(occurs.begin(), end_of_kinds, false) == end_of_kinds &&
         std::find(end_of_kinds, occurs.end(), true) == occurs.end();
}

std::size_t write(const Kinds& kinds, const Tiles& tiles, std::span<std::uint8_t, kMaxTiledBytes> to) {
  if (2 + 4 * kinds.count + kTiles + tiles.all_kinds + 8 * tiles.masks > to.size()) return 0;
  std::uint8_t* end = to.data();
  *end++ = kTiledForm;
  *end++ = static_cast<std::uint8_t>(kinds.count - 1);
  const auto put = [&end](const void* from, std::size_t size) {
    std::memcpy(end, from, size);
    end += size;
  };
  put(kinds.code.data(), kinds.count);
  put(kinds.order.data(), kinds.count);
  put(kinds.object.data(), 2 * kinds.count);
  put(tiles.kinds.data(), kTiles);
  put(tiles.kind.data(), tiles.all_kinds);
  put(tiles.mask.data(), 8 * tiles.masks);
  return static_cast<std::size_t>(end - to.data());
}

}  // namespace
}  // namespace detail

static_assert(std::endian::native == std::endian::little,
              "bricks cross hosts: big-endian hosts need a conversion here");

std::size_t tile_brick(const Workspace::BrickView& brick, std::span<std::uint8_t, kMaxTiledBytes> to) {
  using namespace detail;
  Tiles& tiles = scratch();
  tiles.all_kinds = tiles.masks = 0;
  Kinds kinds;
  if (!HWY_DYNAMIC_DISPATCH(FindTiles)(brick.mu_code, reinterpret_cast<const std::uint8_t*>(brick.order),
                                       brick.object, brick.sole_object, kinds, tiles))
    return 0;
  return write(kinds, tiles, to);
}

core::Status untile_brick(std::span<const std::uint8_t> bytes, BrickContent& content) {
  using namespace detail;
  Tiles& tiles = scratch();
  Kinds kinds;
  if (core::Status status = read(bytes, kinds, tiles); !status) return status;
  if (!all_occur(kinds, tiles)) return refused("names kinds of voxel that do not occur, or voxels twice");
  HWY_DYNAMIC_DISPATCH(PaintTiles)(kinds, tiles, content.voxels);
  content.facts = facts_of(kinds.code.data(), reinterpret_cast<const std::int8_t*>(kinds.order.data()),
                           kinds.object.data(), kinds.count);
  return core::Status::ok();
}

}  // namespace phantom::workspace
#endif  // HWY_ONCE

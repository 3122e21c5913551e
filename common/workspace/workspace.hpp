#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "common/workspace/grid.hpp"
#include "common/workspace/large_pages.hpp"
#include "common/workspace/voxel_box.hpp"

namespace phantom::workspace {

/// Neighbour order of a voxel (spec 1.3; as exported in the NRRD field `order`).
inline constexpr std::int8_t kOrderFree = 0;
inline constexpr std::int8_t kOrderGuard = 99;
inline constexpr std::int8_t kOrderBoundary = 100;
inline constexpr std::int8_t kOrderInterior = 101;  // 1…q: neighbour layers; −1…−n: layers inside the body
/// Returns whether voxels of this order are fluid: part of a layer or of the guard.
constexpr bool is_fluid(std::int8_t order) noexcept {
  return (order > kOrderFree) & (order < kOrderBoundary);  // & vectorises, && does not
}

/// A brick, the unit of storage and of the topic, is a cube of 32³ voxels. It is stored as 8³ tiles of 4³
/// voxels, so that a coherent skin reads few cache lines: a tile has one byte per voxel and fills one line.
inline constexpr std::int32_t kBrickEdge = 32;
/// Returns the number of the brick, along one axis, in which a voxel lies. Rounds down, also below 0.
constexpr std::int32_t brick_along(std::int32_t voxel) { return voxel >> 5; }
static_assert(kBrickEdge == 1 << 5);
inline constexpr std::size_t kBrickVoxels = 32768;

/// Returns the offset of voxel (x,y,z), each 0…31, inside a brick. Tiles are stored x fastest, and so are the
/// voxels within a tile.
constexpr std::size_t brick_offset(std::uint32_t x, std::uint32_t y, std::uint32_t z) noexcept {
  return (((z >> 2) << 6 | (y >> 2) << 3 | x >> 2) << 6) | (z & 3) << 4 | (y & 3) << 2 | (x & 3);
}

/// Address of a brick: voxel index / 32.
struct BrickKey : Index3 {
  friend constexpr auto operator<=>(const BrickKey&, const BrickKey&) = default;
};
/// Returns the brick in which a voxel lies. Rounds down, also below 0.
constexpr BrickKey brick_of(Index3 v) noexcept {
  return {brick_along(v.x), brick_along(v.y), brick_along(v.z)};
}
/// Returns the first voxel of a brick.
constexpr Index3 corner_of(BrickKey key) noexcept { return kBrickEdge * key; }
/// Returns the offset of a voxel, which may lie anywhere, inside its brick.
constexpr std::size_t brick_offset(Index3 v) noexcept {
  return brick_offset(static_cast<std::uint32_t>(v.x & 31), static_cast<std::uint32_t>(v.y & 31),
                      static_cast<std::uint32_t>(v.z & 31));
}
/// Returns the box of the brick's voxels. The last bricks may reach beyond the grid.
constexpr VoxelBox box_of(BrickKey key) noexcept {
  return {corner_of(key), {kBrickEdge, kBrickEdge, kBrickEdge}};
}
/// Returns the box of the bricks in which the voxels of a box, which is not empty, lie.
constexpr VoxelBox bricks_of(const VoxelBox& voxels) noexcept {
  return VoxelBox::between(brick_of(voxels.min), brick_of(voxels.end() - Index3{1, 1, 1}) + Index3{1, 1, 1});
}

/// Holds a brick's orders and object ids, each kBrickVoxels long in brick_offset order. Objects, workspaces
/// and their versions share them; only a sole owner may change them.
struct BrickLabels {
  std::shared_ptr<std::int8_t[]> orders;
  std::shared_ptr<std::uint16_t[]>
      objects;  ///< null: every voxel with a μ belongs to `object`, and no other voxel does
  std::uint16_t object = 0;

  std::size_t bytes() const noexcept {
    return (orders ? kBrickVoxels : 0) + (objects ? kBrickVoxels * sizeof(objects[0]) : 0);
  }
};

/// The workspace voxel array (WVA): one version of all objects of a cell, merged. It is stored in bricks, and
/// only bricks that hold something exist. Treated as immutable once it is shared (std::shared_ptr<const
/// Workspace>).
///
/// A voxel's μ is stored as a code into a palette. μ rises with the code, and code 0 is free space (μ = 0).
/// So "the higher μ prevails" is a byte-wise maximum, and sensing reads one byte. Slot 0 of every array is
/// the empty brick, so that a lookup never branches on whether a brick exists.
class Workspace {
 public:
  Workspace() = default;
  /// `palette_Pa_s_per_m`: μ by code; the first entry is 0, values rise strictly, at most 256 entries (see
  /// check_palette() in profile.hpp). Throws std::invalid_argument if the palette breaks these rules.
  Workspace(const GridSpec& grid, std::vector<float> palette_Pa_s_per_m);

  const GridSpec& grid() const noexcept { return grid_; }
  const std::vector<float>& palette() const noexcept { return palette_; }  ///< Pa·s/m, by code
  /// Gives the codes, which stay as they are, other viscosities. Throws as the constructor does. Not
  /// real-time safe.
  void set_palette(std::vector<float> palette_Pa_s_per_m);
  std::uint64_t version = 0;  ///< set by the builder of the workspace; rises with every change

  /// Look up one voxel. Every voxel outside the grid is free space. Real-time safe: yes.
  std::uint8_t mu_code(Index3 v) const noexcept {
    return grid_.contains(v) ? mu_codes_[address(v)] : std::uint8_t{0};
  }
  float mu(Index3 v) const noexcept { return palette_[mu_code(v)]; }
  std::int8_t order(Index3 v) const noexcept {
    if (!grid_.contains(v)) return kOrderFree;
    const std::size_t at = address(v);
    return slots_[at / kBrickVoxels].labels.orders[static_cast<std::ptrdiff_t>(at % kBrickVoxels)];
  }
  std::uint16_t object(Index3 v) const noexcept {
    if (!grid_.contains(v)) return 0;
    const std::size_t at = address(v);
    return view(static_cast<std::uint32_t>(at / kBrickVoxels)).object_of(at % kBrickVoxels);
  }

  /// Number of bricks along x, y, z.
  const std::array<std::int32_t, 3>& size_bricks() const noexcept { return size_bricks_; }
  bool has_brick(BrickKey key) const noexcept { return directory_[directory_index(key)] != 0; }
  std::vector<BrickKey> bricks() const;  ///< the existing bricks, sorted by z, then y, then x
  std::size_t brick_count() const noexcept { return brick_count_; }
  std::size_t bytes() const noexcept;  ///< includes labels shared with objects and other workspaces

  /// Points to one brick's arrays, kBrickVoxels long, in brick_offset order. For a brick that does not exist
  /// they are those of the empty brick.
  struct BrickView {
    const std::uint8_t* mu_code;
    const std::int8_t* order;
    const std::uint16_t* object;  ///< null: every voxel with a μ belongs to `sole_object`
    std::uint16_t sole_object = 0;

    /// Returns the object of a voxel, given by its brick_offset; 0 if there is none. Real-time safe: yes.
    std::uint16_t object_of(std::size_t voxel) const noexcept {
      return object != nullptr ? object[voxel] : mu_code[voxel] != 0 ? sole_object : std::uint16_t{0};
    }
    /// Writes the object ids of all kBrickVoxels voxels; 0 where there is none.
    void copy_objects(std::uint16_t* to) const;
  };
  struct MutableBrick {
    std::uint8_t* mu_code;
    std::int8_t* order;
    std::uint16_t* object;
  };
  BrickView brick(BrickKey key) const noexcept { return view(directory_[directory_index(key)]); }
  /// Creates or replaces a brick and returns its μ codes, all of which the caller must write. The pointer is
  /// valid until a brick is created for which reserve_bricks() reserved no room. Not real-time safe.
  std::uint8_t* make_brick(BrickKey key, BrickLabels labels);
  /// Creates or replaces a brick whose voxels are all equal. Equal bricks of this kind share their memory.
  void fill_brick(BrickKey key, std::uint8_t mu_code, std::int8_t order, std::uint16_t object);
  /// Copies a brick from `from`, which must have the same grid and codes. Labels are shared.
  void copy_brick(const Workspace& from, BrickKey key);
  /// Returns a brick for changing. Creates it as free space if it does not exist, and copies memory that it
  /// shares. The pointers are valid until the next call that creates or edits a brick. Not real-time safe.
  MutableBrick edit_brick(BrickKey key);
  void remove_brick(BrickKey key);
  /// Reserves room for `count` bricks in total, so that creating them neither moves nor over-allocates
  /// memory.
  void reserve_bricks(std::size_t count);
  /// Reserves room for this many additional bricks. Room left by removed bricks counts.
  void reserve_more(std::size_t bricks) {
    if (bricks > free_slots_.size()) reserve_bricks(slots_.size() - 1 + bricks - free_slots_.size());
  }

  /// Returns a hash of grid, palette and all bricks. It does not depend on the order in which the bricks were
  /// created.
  std::uint64_t content_hash() const;

  /// Raw arrays for the sensing kernel. The μ code of voxel v is codes[directory[brick index]·kBrickVoxels +
  /// brick_offset].
  const std::uint32_t* directory() const noexcept { return directory_.data(); }
  const std::uint8_t* codes() const noexcept { return mu_codes_.data(); }

  std::size_t directory_index(BrickKey key) const noexcept { return VoxelBox{{}, size_bricks_}.index(key); }

 private:
  std::size_t address(Index3 v) const noexcept {
    return directory_[directory_index(brick_of(v))] * kBrickVoxels + brick_offset(v);
  }

  /// Describes the memory of one brick.
  struct Slot {
    std::uint32_t users = 0;  ///< number of bricks that use this memory; 0: free
    bool uniform = false;     ///< created by fill_brick(); never changed
    BrickLabels labels;
  };
  BrickView view(std::uint32_t slot) const noexcept {
    const BrickLabels& labels = slots_[slot].labels;
    return {mu_codes_.data() + slot * kBrickVoxels, labels.orders.get(), labels.objects.get(), labels.object};
  }
  std::uint8_t* codes_at(std::uint32_t slot) noexcept { return mu_codes_.data() + slot * kBrickVoxels; }
  std::uint32_t make_slot(BrickKey key, BrickLabels labels);

  GridSpec grid_;
  std::vector<float> palette_{0.0F};
  std::array<std::int32_t, 3> size_bricks_{0, 0, 0};
  std::vector<std::uint32_t> directory_;  // slot of each brick; 0: the empty brick
  LargeVector<std::uint8_t> mu_codes_;
  std::vector<Slot> slots_;
  std::size_t brick_count_ = 0;
  std::vector<std::uint32_t> free_slots_, uniform_slots_;
};

}  // namespace phantom::workspace

#pragma once

#include <memory>
#include <mutex>
#include <vector>

#include "common/workspace/large_pages.hpp"
#include "common/workspace/workspace.hpp"

namespace phantom::workspace {

/// Allocates memory for a known number of bricks in large pieces. A piece is freed when none of its bricks is
/// used any more. Thread-safe.
class BrickMemory {
 public:
  /// `most`: the number of bricks that will be held at the same time.
  explicit BrickMemory(std::size_t most) : left_(most) {}

  /// Returns room for kBrickVoxels orders, with undefined content.
  std::shared_ptr<std::int8_t[]> take();
  /// Takes back a brick that is not needed, for the next take().
  void give_back(std::shared_ptr<std::int8_t[]> orders);

 private:
  std::mutex mutex_;
  std::size_t left_, left_in_piece_ = 0;
  std::shared_ptr<std::int8_t[]> next_;
  std::vector<std::shared_ptr<std::int8_t[]>> spare_;
};

/// Holds one object's neighbour orders as sparse bricks of the workspace's grid, one byte per voxel in
/// brick_offset order. This is what an object adds to the workspace; it is kept so that other objects can be
/// merged again without recomputing this one. Bricks that are interior throughout share one block of memory.
/// Movable; treated as immutable once merged.
class ObjectBricks {
 public:
  /// A brick of the object. `orders`: kBrickVoxels long; null for "interior throughout".
  struct Part {
    BrickKey key;
    std::shared_ptr<std::int8_t[]> orders;
  };

  ObjectBricks() = default;
  /// Builds from parts in any order, each key once. Leave out bricks that hold nothing.
  explicit ObjectBricks(std::vector<Part> parts);

  /// Returns the bricks that hold something, sorted by BrickKey.
  const std::vector<BrickKey>& keys() const noexcept { return keys_; }
  /// Returns the brick's kBrickVoxels orders, or null if the object has nothing there. Takes time logarithmic
  /// in the number of bricks.
  const std::int8_t* orders(BrickKey key) const noexcept;
  /// Returns the same with shared ownership. The orders must not be changed. Also returns null if the brick
  /// is interior throughout.
  std::shared_ptr<std::int8_t[]> share(BrickKey key) const noexcept;
  /// Returns whether the brick is stored as "interior throughout".
  bool is_interior(BrickKey key) const noexcept;
  /// Returns the same as orders(), for changing, or null if the object has nothing there. Must not be called
  /// once share() has been called.
  std::int8_t* edit(BrickKey key);
  /// Returns the order of a voxel whose indices are not negative; free if the object has nothing there.
  std::int8_t at(Index3 v) const noexcept;
  /// Moves the parts out, as the constructor takes them, and leaves the object empty.
  std::vector<Part> take_parts();
  /// Returns the memory used, in bytes.
  std::size_t bytes() const noexcept;

 private:
  const std::shared_ptr<std::int8_t[]>* find(BrickKey key) const noexcept;

  std::vector<BrickKey> keys_;
  std::vector<std::shared_ptr<std::int8_t[]>> orders_;  // in the order of keys_; null: interior throughout
};

}  // namespace phantom::workspace

#pragma once

#include <memory>
#include <mutex>
#include <vector>

#include "common/workspace/large_pages.hpp"
#include "common/workspace/workspace.hpp"

namespace phantom::workspace {

/// Memory for a known number of bricks, taken from the heap in large pieces, each of which lives as long as
/// one of its bricks. All calls from any thread.
class BrickMemory {
 public:
  /// `most`: bricks that will be held at once.
  explicit BrickMemory(std::size_t most) : left_(most) {}

  /// kBrickVoxels orders, whatever they are.
  std::shared_ptr<std::int8_t[]> take();
  /// A brick that is not needed after all.
  void give_back(std::shared_ptr<std::int8_t[]> orders);

 private:
  std::mutex mutex_;
  std::size_t left_, left_in_piece_ = 0;
  std::shared_ptr<std::int8_t[]> next_;
  std::vector<std::shared_ptr<std::int8_t[]>> spare_;
};

/// One object's neighbour orders as sparse bricks of the workspace's grid, one byte a voxel in brick_offset
/// layout: what an object adds to the workspace, kept so that others can be merged anew beside it. Bricks
/// that are interior throughout share one block of memory. Movable; treated as immutable once merged.
class ObjectBricks {
 public:
  /// A brick to be made; `orders`: kBrickVoxels long, null for "interior throughout".
  struct Part {
    BrickKey key;
    std::shared_ptr<std::int8_t[]> orders;
  };

  ObjectBricks() = default;
  /// Of parts in any order, each key once. Leave out bricks that hold nothing.
  explicit ObjectBricks(std::vector<Part> parts);

  /// Bricks that hold something, rising by BrickKey's order.
  const std::vector<BrickKey>& keys() const noexcept { return keys_; }
  /// kBrickVoxels orders, or null where the object has nothing. Time: log of the bricks.
  const std::int8_t* orders(BrickKey key) const noexcept;
  /// The same as a share in the memory, not to be changed; null too where the brick is interior throughout.
  std::shared_ptr<std::int8_t[]> share(BrickKey key) const noexcept;
  /// Whether the brick is interior throughout, and known to be.
  bool is_interior(BrickKey key) const noexcept;
  /// The same as orders(), to be changed (not once share() was called); null where the object has nothing.
  std::int8_t* edit(BrickKey key);
  /// Order of a voxel of the grid, none of whose indices is negative; free where the object has nothing.
  std::int8_t at(Index3 v) const noexcept;
  /// The parts that it is made of, as for the constructor; it is empty then.
  std::vector<Part> take_parts();
  /// Memory taken.
  std::size_t bytes() const noexcept;

 private:
  std::vector<BrickKey> keys_;
  std::vector<std::shared_ptr<std::int8_t[]>> orders_;  // as keys_; null: interior throughout
};

}  // namespace phantom::workspace

#pragma once

#include <vector>

#include "common/fusion/camera_history.hpp"
#include "common/fusion/prepared_depth.hpp"

namespace phantom::fusion {

/// Least and greatest depth of parts of an image, over pixels with a depth only. Those of the arm have that
/// before which nothing is.
class DepthPyramid {
 public:
  struct Depths {
    float least_vox = kNone, greatest_vox = 0.0F;
    bool seen = false;  ///< at least half of the pixels of each cell have a depth

    bool any() const noexcept { return greatest_vox > 0.0F; }
  };
  static constexpr float kNone = 1e9F;

  /// By how much a cell's least and greatest depth may differ from before: `offset` + `slope` · depth².
  struct Tolerance {
    float offset_vox = 0.0F, slope = 0.0F;
  };

  /// Returns how many cells an image has on its finest level.
  static std::size_t cells_of(const PinholeCamera& camera);
  /// Builds the pyramid of an image, and compares its cells with what its camera saw before. Allocates only
  /// for a larger image than before.
  void build(const PreparedDepth& depth, SeenCells& before, const Tolerance& tolerance);
  /// Returns the depths of the cells that hold the pixels [u0, u1] × [v0, v1], which lie in the image: these
  /// pixels, and some around them. Takes constant time.
  Depths in(int u0, int v0, int u1, int v1) const noexcept;
  /// Returns whether the least and the greatest depth of each of the finest cells that hold these pixels are
  /// as the camera saw them before.
  bool steady(int u0, int v0, int u1, int v1) const noexcept;

 private:
  static constexpr int kCellBits = 3, kLevels = 8;  // cells of 8 to 1024 pixels

  struct Cell {
    float least = kNone, greatest = 0.0F;
    bool seen = false;
  };
  struct Level {
    int width = 0, height = 0;
    std::vector<Cell> cells;

    Cell& at(int x, int y) {
      return cells[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                   static_cast<std::size_t>(x)];
    }
    const Cell& at(int x, int y) const {
      return cells[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                   static_cast<std::size_t>(x)];
    }
    void resize(int cells_x, int cells_y);
  };
  void build_first(const PreparedDepth& depth);
  void compare(const PreparedDepth& depth, SeenCells& before, const Tolerance& tolerance);
  template <class RowOf, class Each>
  void for_cells(int width_px, int height_px, const RowOf& row_of, const Each& each);

  std::array<Level, kLevels> levels_;
  std::vector<std::uint8_t> changed_;            // the finest cells
  std::vector<float> least_, greatest_, count_;  // of the columns of a row of cells
};

}  // namespace phantom::fusion

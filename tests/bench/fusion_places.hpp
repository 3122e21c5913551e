#pragma once

#include <random>
#include <vector>

#include "common/fusion/tests/scenes.hpp"

namespace phantom::bench {

/// 10⁵ places in the cell of the targets, as a skin of so many sensors looks them up.
inline std::vector<Eigen::Vector3d> looked_up_places() {
  const workspace::GridSpec grid = fusion::scenes::cell_grid();
  std::mt19937 random(1);
  std::uniform_real_distribution<double> share(0.0, 1.0);
  std::vector<Eigen::Vector3d> places_m(100'000);
  for (Eigen::Vector3d& place_m : places_m)
    for (Eigen::Index i = 0; i < 3; ++i)
      place_m[i] = grid.origin_m[i] + 0.999 * share(random) * grid.voxel_size_m.sides_m()[i] *
                                          grid.size_vox[static_cast<std::size_t>(i)];
  return places_m;
}

}  // namespace phantom::bench

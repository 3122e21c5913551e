#include "common/percept/closeness.hpp"

#include <algorithm>

namespace phantom::percept {

double greatest_neighbour_mu(const workspace::Workspace& workspace) {
  std::uint8_t greatest = 0;
  for (const workspace::BrickKey key : workspace.bricks()) {
    const auto brick = workspace.brick(key);
    for (std::size_t i = 0; i < workspace::kBrickVoxels; ++i) {
      if (workspace::is_fluid(brick.order[i])) greatest = std::max(greatest, brick.mu_code[i]);
    }
  }
  return static_cast<double>(workspace.palette()[greatest]);
}

double closeness(double mu, double greatest_neighbour_mu) noexcept {
  if (!(mu > 0.0)) return 0.0;
  return greatest_neighbour_mu > 0.0 ? std::min(1.0, mu / greatest_neighbour_mu) : 1.0;
}

}  // namespace phantom::percept

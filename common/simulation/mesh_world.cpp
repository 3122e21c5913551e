#include "common/simulation/mesh_world.hpp"

#include <algorithm>

namespace phantom::simulation {

MeshWorld::MeshWorld(const std::vector<geometry::PlacedMesh>& bodies, double range_m,
                     const std::vector<std::uint16_t>& soft)
    : range_m_(range_m) {
  for (const geometry::PlacedMesh& body : bodies) {
    const bool is_soft = std::find(soft.begin(), soft.end(), body.id) != soft.end();
    for (const geometry::TriangleMesh& shell : closed_shells(body.mesh_W))
      if (!shell.triangles.empty()) bodies_.push_back({MeshSurface(shell), body.id, is_soft});
  }
}

ContactQuery MeshWorld::query(const Eigen::Vector3d& p_W_m, bool soft_too) const noexcept {
  ContactQuery found{range_m_, Eigen::Vector3d::Zero(), 0};
  for (const Body& body : bodies_) {
    if (body.soft && !soft_too) continue;
    const double square_to_box = body.surface.square_to_box(p_W_m);
    if (square_to_box > 0.0 &&
        (found.distance_m < 0.0 || square_to_box > found.distance_m * found.distance_m))
      continue;
    // In the box the point may be in the body, and deeper than it is in or far from the others.
    const double limit_m = square_to_box > 0.0 ? found.distance_m : range_m_;
    const MeshSurface::Nearest nearest = body.surface.nearest(p_W_m, limit_m);
    if (nearest.distance_m < found.distance_m) found = {nearest.distance_m, nearest.normal, body.id};
  }
  return found;
}

}  // namespace phantom::simulation

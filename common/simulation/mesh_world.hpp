#pragma once

#include <vector>

#include "common/geometry/mesh/placed_mesh.hpp"
#include "common/simulation/contact_world.hpp"
#include "common/simulation/mesh_surface.hpp"

namespace phantom::simulation {

/// The bodies of a cell by their meshes. Where bodies overlap, the distance is the least of theirs.
class MeshWorld final : public ContactWorld {
 public:
  /// `bodies`: in W. `range_m`: distances up to here are known. `soft`: ids of bodies that give way to the
  /// arm.
  MeshWorld(const std::vector<geometry::PlacedMesh>& bodies, double range_m,
            const std::vector<std::uint16_t>& soft = {});

  double distance_m(const Eigen::Vector3d& p_W_m) const noexcept override { return query(p_W_m).distance_m; }
  ContactQuery query(const Eigen::Vector3d& p_W_m) const noexcept override { return query(p_W_m, true); }
  ContactQuery query_rigid(const Eigen::Vector3d& p_W_m) const noexcept override {
    return query(p_W_m, false);
  }
  double range_m() const noexcept override { return range_m_; }

 private:
  struct Body {
    MeshSurface surface;
    std::uint16_t id;
    bool soft;
  };
  ContactQuery query(const Eigen::Vector3d& p_W_m, bool soft_too) const noexcept;
  std::vector<Body> bodies_;
  double range_m_;
};

}  // namespace phantom::simulation
